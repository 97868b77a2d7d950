#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""assimp reads every mesh that write_meshes wrote: read_meshes.py FOLDER"""
import pathlib
import sys
import unittest

from foreign_mesh import ForeignMesh

FOLDER = pathlib.Path(sys.argv.pop())
VERTICES = [(10, 20, 600), (40, 20, 600), (10, 50, 600), (10, 20, 630)]
TRIANGLES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
LEVELS = {vertex: level / 255 for vertex, level in zip(VERTICES, (0, 51, 102, 255))}


def corners(triangles):
    """Triangles as their corners' places, each from its smallest, in an order of their own."""
    turned = []
    for triangle in triangles:
        first = triangle.index(min(triangle))
        turned.append(triangle[first:] + triangle[:first])
    return sorted(turned)


def volume(triangles):
    """Positive if the corners run counter-clockwise, seen from outside."""
    total = 0
    for (ax, ay, az), (bx, by, bz), (cx, cy, cz) in triangles:
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


class Files(unittest.TestCase):
    def read(self, name):
        mesh = ForeignMesh(FOLDER / f"mesh.{name}")
        places = [tuple(round(value, 6) for value in vertex) for vertex in mesh.vertices]
        if name == "glb":  # metres, y up
            places = [tuple(round(1000 * value, 3) for value in (x, -y, -z)) for x, y, z in places]
        return mesh, places, corners([tuple(places[i] for i in face) for face in mesh.triangles])

    def test_every_format_has_the_same_triangles(self):
        expected = corners([tuple(VERTICES[i] for i in triangle) for triangle in TRIANGLES])
        self.assertAlmostEqual(volume(expected), 30**3 / 6)
        for name in ("ply", "stl", "obj", "glb"):
            with self.subTest(format=name):
                self.assertEqual(self.read(name)[2], expected)

    def test_intensities_are_the_vertices_colours(self):
        for name in ("ply", "obj", "glb"):
            with self.subTest(format=name):
                mesh, places, _ = self.read(name)
                self.assertEqual(len(mesh.colours), len(places))
                for place, (red, green, blue, alpha) in zip(places, mesh.colours):
                    for value in (red, green, blue):
                        self.assertAlmostEqual(value, LEVELS[place], places=3)
                    self.assertEqual(alpha, 1)

    def test_glb_is_in_metres_before_the_viewer(self):
        mesh = ForeignMesh(FOLDER / "mesh.glb")
        for x, y, z in mesh.vertices:
            self.assertTrue(0 < x < 0.05 and -0.06 < y < 0 and -0.7 < z < -0.5, (x, y, z))

    def test_normals_point_outwards(self):
        for name in ("stl", "glb"):
            with self.subTest(format=name):
                mesh, places, _ = self.read(name)
                middle = [sum(axis) / 4 for axis in zip(*VERTICES)]
                for place, (x, y, z) in zip(places, mesh.normals):
                    turned = (x, -y, -z) if name == "glb" else (x, y, z)
                    self.assertAlmostEqual(x * x + y * y + z * z, 1, places=4)
                    self.assertGreater(sum(n * (p - m) for n, p, m in zip(turned, place, middle)), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
