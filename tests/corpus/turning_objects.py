#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Writes objects of 15 to 20 cm that render_turning.py can turn, as closed meshes in mm. Needs pymeshlab.

They turn about y, which points down, as in a camera's frame. A jug is round and smooth, and its handle hides part of it. A bracket
has planes, sharp edges and holes, as machined parts have. Crossed plates and a single plate show little else than planes.
"""
import argparse
import pathlib

import numpy as np
import pymeshlab

SEGMENTS = 192
MERGED_MM = 1e-3


def revolved(radii, heights):
    """Turns a profile about the y axis. It begins and ends on the axis, outside first.

    radii, heights  mm, from the foot on; @return vertices, triangles
    """
    angles = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    rings = [np.stack([r * np.cos(angles), np.full(SEGMENTS, -y), r * np.sin(angles)], 1)
             for r, y in zip(radii[1:-1], heights[1:-1])]
    vertices = np.concatenate([[[0, -heights[0], 0]], *rings, [[0, -heights[-1], 0]]])
    this, count = np.arange(SEGMENTS), len(rings)
    beside, top = (this + 1) % SEGMENTS, 1 + (count - 1) * SEGMENTS
    faces = [np.stack([np.zeros_like(this), 1 + this, 1 + beside], 1),
             np.stack([np.full_like(this, len(vertices) - 1), top + beside, top + this], 1)]
    for ring in range(count - 1):
        low, high = 1 + ring * SEGMENTS, 1 + (ring + 1) * SEGMENTS
        faces += [np.stack([low + this, high + this, high + beside], 1), np.stack([low + this, high + beside, low + beside], 1)]
    return outward(vertices, np.concatenate(faces))


def tube(middles, radius):
    """A round bar along a curve in the plane of x and y, closed at both ends."""
    along = np.gradient(middles, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], 1)
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    rings = [middle + radius * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * [0, 0, 1])
             for middle, side in zip(middles, across)]
    vertices = np.concatenate([middles[:1], *rings, middles[-1:]])
    this, beside = np.arange(48), (np.arange(48) + 1) % 48
    last = 1 + 48 * (len(rings) - 1)
    faces = [np.stack([np.zeros_like(this), 1 + beside, 1 + this], 1),
             np.stack([np.full_like(this, len(vertices) - 1), last + this, last + beside], 1)]
    for ring in range(len(rings) - 1):
        low, high = 1 + ring * 48, 1 + (ring + 1) * 48
        faces += [np.stack([low + this, low + beside, high + beside], 1), np.stack([low + this, high + beside, high + this], 1)]
    return outward(vertices, np.concatenate(faces))


def box(low, high):
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return outward(corners, np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]))


def rod(radius, length, place, lies=False):
    """A cylinder along y, or along z if it lies."""
    vertices, faces = revolved([0, radius, radius, 0], [-length / 2, -length / 2, length / 2, length / 2])
    return (vertices[:, [0, 2, 1]] if lies else vertices) + place, faces[:, ::-1] if lies else faces


def outward(vertices, faces):
    """The same, with the corners of each triangle in the order that makes the volume positive."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return (vertices, faces) if (a * np.cross(b, c)).sum() > 0 else (vertices, faces[:, ::-1])


def combined(body, others, how):
    """@param how  union or difference"""
    for other in others:
        meshes = pymeshlab.MeshSet()
        for vertices, faces in (body, other):
            meshes.add_mesh(pymeshlab.Mesh(np.ascontiguousarray(vertices, float), np.ascontiguousarray(faces, np.int32)))
        getattr(meshes, f"generate_boolean_{how}")(first_mesh=0, second_mesh=1)
        # What the file's floats could not tell apart would leave gaps.
        meshes.meshing_merge_close_vertices(threshold=pymeshlab.PureValue(MERGED_MM))
        meshes.meshing_remove_null_faces()
        result = meshes.current_mesh()
        body = result.vertex_matrix(), result.face_matrix()
    return body


def jug():
    height = np.linspace(0, 180, 91)
    belly = 48 + 22 * np.sin(np.pi * (height / 180) ** 0.8) - 16 * np.exp(-((height - 150) / 22) ** 2)
    outside = revolved([0, *belly, 0], [0, *height, 180])
    inside = revolved([0, *(belly[4:] - 6), belly[-1] - 6, 0], [8, *height[4:], 190, 190])
    turn = np.linspace(-0.62 * np.pi, 0.62 * np.pi, 60)
    handle = np.stack([62 + 38 * np.cos(turn), -(92 + 50 * np.sin(turn)), np.zeros(60)], 1)
    vertices, faces = combined(combined(outside, [tube(handle, 8.0)], "union"), [inside], "difference")
    return vertices + [0, 90, 0], faces


def bracket():
    foot, wall = box((-70, 44, -50), (70, 56, 50)), box((-70, -60, 38), (70, 50, 50))
    ribs = [box((x - 4, -20, -10), (x + 4, 50, 42)) for x in (-58, 58)]
    body = combined(foot, [wall, *ribs, rod(26, 40, (0, 30, -8))], "union")
    holes = [rod(13, 80, (0, 30, -8)), *(rod(9, 40, (x, -35, 44), lies=True) for x in (-42, 42)), rod(20, 40, (0, -20, 44), lies=True)]
    return combined(body, holes, "difference")


def cross():
    across, foot = box((20, -40, -60), (28, 60, 60)), box((-70, 52, -40), (70, 60, 40))
    return combined(box((-70, -60, -4), (70, 60, 4)), [across, foot], "union")


def plate():
    cut_off = [rod(20, 40, (25, -15, 0), lies=True), box((-80, 30, -20), (-35, 80, 20))]
    return combined(box((-70, -60, -5), (70, 60, 5)), cut_off, "difference")


OBJECTS = {"jug": jug, "bracket": bracket, "cross": cross, "plate": plate}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("object", choices=OBJECTS)
    parser.add_argument("file", type=pathlib.Path, help="PLY to write")
    given = parser.parse_args()
    vertices, faces = OBJECTS[given.object]()
    with given.file.open("wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {len(vertices)}\n"
                   "property float x\nproperty float y\nproperty float z\n"
                   f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode())
        vertices.astype("<f4").tofile(file)
        records = np.zeros(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
        records["count"], records["corners"] = 3, faces
        records.tofile(file)


if __name__ == "__main__":
    main()
