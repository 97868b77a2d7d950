#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans with colour: from colour files and from a Bayer mosaic, in every format, and what is refused."""
import pathlib
import shutil
import struct
import tempfile
import unittest

import numpy as np

from client import RpcError
from service import SCENE, Service, slsctl

KINDS = {"float": "<f4", "uchar": "u1", "int": "<i4"}
INVALID_PARAMS, UNSUPPORTED = -32602, -32010


def ply(bytes_):
    """The records of any of slsd's PLY clouds."""
    header, body = bytes_.split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode().split("\n")]
    return np.frombuffer(body, np.dtype([(line[2], KINDS[line[1]]) for line in lines if line[:1] == ["property"]]))


def pcd(bytes_):
    """The measured points of a PCD, and their colours, which PCL packs into a float."""
    header, body = bytes_.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in header.decode().split("\n") if line and line[0] != "#")
    kinds = [{"F": "<f4", "U": "u1", "I": "<i4"}[kind] for kind in fields["TYPE"].split()]
    points = np.frombuffer(body, np.dtype(list(zip(fields["FIELDS"].split(), kinds))))
    points = points[~np.isnan(points["z"])]
    packed = np.ascontiguousarray(points["rgb"]).view("<u4")
    return points, np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1)


def colours(points):
    return np.stack([points[name] for name in ("red", "green", "blue")], axis=1).astype(int)


def gradient(width, height):
    """Red grows to the right, blue falls downwards: each place of the picture has its own colour."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([40 + x // 10, np.full_like(x, 120), 200 - y // 10], axis=2).astype(np.uint8)


def seen_at(points):
    """The gradient at the places of points."""
    return np.stack([40 + points["camera_u"] / 10, np.full(len(points), 120), 200 - points["camera_v"] / 10], axis=1)


class Colour(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.frames = pathlib.Path(temporary.name) / "frames"
        self.frames.mkdir()
        shutil.copy(SCENE / "frame.png", self.frames)
        self.picture = gradient(1600, 1200)

    def record(self, folder, picture):
        (self.frames / folder).mkdir(exist_ok=True)
        height, width = picture.shape[:2]
        header = f"P{6 if picture.ndim == 3 else 5} {width} {height} 255\n"
        (self.frames / folder / "0.ppm").write_bytes(header.encode() + picture.astype(np.uint8).tobytes())

    def serve(self, camera=""):
        service = Service(camera_path=self.frames, camera=camera).start()
        self.addCleanup(service.__exit__)
        client = service.client()
        self.addCleanup(client.close)
        return service, client

    def scan(self, service, file, *options):
        written = slsctl("--socket", service.socket, "scan", "--colour", "--timeout-ms", "600000", "-o", file, *options)
        self.assertEqual(written.returncode, 0, written.stderr)

    def refused(self, client, code, **params):
        with self.assertRaises(RpcError) as raised:
            client.call("scan", **params)
        self.assertEqual(raised.exception.code, code)
        return str(raised.exception)

    def test_points_have_the_colour_of_their_place(self):
        self.record("white", self.picture)
        _, client = self.serve()
        points = ply(client.call("scan", colour=True)[1])
        self.assertGreater(len(points), 1000)
        self.assertLess(np.abs(colours(points) - seen_at(points)).max(), 2)
        grey = colours(points) @ [0.299, 0.587, 0.114]
        self.assertLess(np.abs(grey - points["intensity"]).max(), 2)
        organised, packed = pcd(client.call("scan", colour=True, format="pcd")[1])
        self.assertLess(np.abs(packed - seen_at(organised)).max(), 2)
        self.assertNotIn("red", ply(client.call("scan", texture=True)[1]).dtype.names)

    def test_pixels_have_their_own_colour_in_every_format(self):
        self.record("white", self.picture)
        service, client = self.serve()
        for normals in (False, True):
            scan, cloud = client.call("scan", colour=True, density="pixels", normals=normals, format="pcd")
            points, packed = pcd(cloud)
            self.assertEqual(len(points), scan["points"])
            measured = ~np.isnan(np.frombuffer(
                cloud.split(b"DATA binary\n", 1)[1], points.dtype)["z"].reshape(scan["height_px"], scan["width_px"]))
            np.testing.assert_array_equal(packed, self.picture[measured])
            same = ply(client.call("scan", colour=True, density="pixels", normals=normals)[1])
            np.testing.assert_array_equal(colours(same), packed)
            self.scan(service, service.folder / "cloud.ply", "--density", "pixels", *(["--normals"] if normals else []),
                      "--cloud-picture", service.folder / "cloud.png")
            np.testing.assert_array_equal(colours(ply((service.folder / "cloud.ply").read_bytes())), packed)

    def test_meshes_show_the_colour(self):
        self.record("white", self.picture)
        service, _ = self.serve()
        for kind in ("obj", "glb"):
            self.scan(service, service.folder / f"mesh.{kind}")
        lines = [line.split() for line in (service.folder / "mesh.obj").read_text().split("\n") if line.startswith("v ")]
        of_vertices = np.rint(255 * np.array([line[4:7] for line in lines], dtype=float)).astype(int)
        self.assertEqual(set(of_vertices[:, 1]), {120})
        self.assertGreater(np.ptp(of_vertices[:, 0]), 60)
        glb = (service.folder / "mesh.glb").read_bytes()
        data = glb[28 + struct.unpack_from("<I", glb, 12)[0]:]
        of_glb = np.frombuffer(data, "u1", 4 * len(lines), 24 * len(lines)).reshape(-1, 4)
        np.testing.assert_array_equal(of_glb[:, :3], of_vertices)

    def test_colour_comes_from_a_mosaic(self):
        mosaic = np.empty(self.picture.shape[:2], np.uint8)
        for down, right, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
            mosaic[down::2, right::2] = self.picture[down::2, right::2, channel]
        self.record("white", mosaic)
        _, client = self.serve('bayer = "RGGB"\nwhite_balance = [0.5, 1, 1.2]')
        scan, cloud = client.call("scan", colour=True)
        points = ply(cloud)
        self.assertGreater(len(points), 1000)
        self.assertLess(np.abs(colours(points) - seen_at(points) * [0.5, 1, 1.2]).max(), 2.5)
        mean = (colours(points) / [0.5, 1, 1.2]).mean(axis=0)
        np.testing.assert_allclose(scan["white_balance"]["camera"], [mean[1] / mean[0], 1, mean[1] / mean[2]], atol=0.01)
        red, green, blue = (colours(points) / [0.5, 1, 1.2]).T
        self.assertLess(np.abs((red + 2 * green + blue) / 4 - points["intensity"]).max(), 2)

    def test_room_light_is_subtracted(self):
        self.record("white", self.picture)
        self.record("dark", np.full_like(self.picture, (10, 20, 30)))
        _, client = self.serve()
        points = ply(client.call("scan", colour=True, ambient=True)[1])
        self.assertLess(np.abs(colours(points) - (seen_at(points) - [10, 20, 30])).max(), 2)

    def test_what_has_no_colour_is_refused(self):
        self.record("white", self.picture[:, :, 1])
        service, client = self.serve()
        self.assertIn("no camera gives colours", self.refused(client, UNSUPPORTED, colour=True))
        self.assertIn("leave out", self.refused(client, INVALID_PARAMS, colour=True, texture=False))
        refused = slsctl("--socket", service.socket, "scan", "--colour")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("no camera gives colours", refused.stderr)
        self.assertGreater(client.call("scan", texture=True)[0]["points"], 1000)


if __name__ == "__main__":
    unittest.main()
