#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A point for each camera pixel: what a request gets, in every format, and what is refused."""
import math
import pathlib
import struct
import tempfile
import unittest

from client import RpcError
from service import Service, slsctl

INVALID_PARAMS = -32602
NO_POINT = b"\x00\x00\xc0\x7f"


def ply(bytes_):
    """The header's lines, and the records."""
    header, body = bytes_.split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    size = sum({"float": 4, "uchar": 1}[line.split()[1]] for line in lines if line.startswith("property"))
    assert len(body) == count * size, (len(body), count, size)
    return [line.split()[2] for line in lines if line.startswith("property")], [
        body[i:i + size] for i in range(0, len(body), size)]


def pcd(bytes_):
    header, body = bytes_.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in header.decode().split("\n") if line and not line.startswith("#"))
    width, height = int(fields["WIDTH"]), int(fields["HEIGHT"])
    size = sum(int(bytes_of) for bytes_of in fields["SIZE"].split())
    assert len(body) == width * height * size
    return fields, width, height, [body[i:i + size] for i in range(0, len(body), size)]


def tiff_pages(bytes_):
    assert bytes_[:4] == b"II*\0"
    pages, at = [], struct.unpack_from("<I", bytes_, 4)[0]
    while at:
        count = struct.unpack_from("<H", bytes_, at)[0]
        tags = {}
        for i in range(count):
            tag, kind, number, value = struct.unpack_from("<HHII", bytes_, at + 2 + 12 * i)
            tags[tag] = value & 0xFFFF if kind == 3 else value
        assert (tags[258], tags[259], tags[339]) == (32, 1, 3), tags
        pixels = struct.unpack_from(f"<{tags[256] * tags[257]}f", bytes_, tags[273])
        pages.append((tags[256], tags[257], pixels))
        at = struct.unpack_from("<I", bytes_, at + 2 + 12 * count)[0]
    return pages


class Dense(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.client = cls.service.client()
        _, cls.organised = cls.client.call("scan", density="pixels", timeout_ms=60_000, format="pcd")

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.service.__exit__()

    def test_formats_hold_the_same_points(self):
        scan, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000)
        fields, width, height, records = pcd(self.organised)
        self.assertEqual((scan["density"], scan["width_px"], scan["height_px"]), ("pixels", width, height))
        names, points = ply(cloud)
        self.assertEqual(names, ["x", "y", "z", "sigma_mm", "intensity", "camera"])
        self.assertEqual(fields["FIELDS"].split(), names)
        self.assertEqual(len(points), scan["points"])
        self.assertEqual(scan["pixels"]["measured"], scan["points"])
        self.assertEqual(sum(scan["pixels"].values()), width * height)
        self.assertGreater(scan["points"], 0.2 * width * height)
        measured = [record for record in records if not math.isnan(struct.unpack_from("<f", record, 8)[0])]
        self.assertEqual(measured, points)
        self.assertEqual({record for record in records if math.isnan(struct.unpack_from("<f", record, 8)[0])},
                         {4 * NO_POINT + b"\0\0"})
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, format="tiff")
        (width_z, height_z, depth), (_, _, sigma) = tiff_pages(cloud)
        self.assertEqual((width_z, height_z), (width, height))
        for record, z, of_sigma in list(zip(records, depth, sigma))[::997]:
            self.assertEqual(struct.pack("<f", z) if z == z else NO_POINT, record[8:12])
            self.assertEqual(math.isnan(of_sigma), math.isnan(z))

    def test_normals_face_the_camera(self):
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, normals=True)
        names, points = ply(cloud)
        self.assertEqual(names[6:], ["nx", "ny", "nz"])
        for point in points[::1009]:
            x, y, z, nx, ny, nz = struct.unpack_from("<3f", point) + struct.unpack_from("<3f", point, 18)
            self.assertAlmostEqual(nx * nx + ny * ny + nz * nz, 1, 4)
            self.assertLess(nx * x + ny * y + nz * z, 0)
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, normals=True, format="pcd")
        self.assertEqual(pcd(cloud)[0]["FIELDS"].split()[6:], ["normal_x", "normal_y", "normal_z"])

    def test_what_does_not_go_together_is_refused(self):
        for params in ({"format": "tiff"}, {"normals": True}, {"density": "symbols", "normals": True},
                       {"density": "pixels", "format": "tiff", "normals": True}, {"density": "voxels"}):
            for method in ("scan", "subscribe"):
                with self.assertRaises(RpcError) as refused:
                    self.client.call(method, **params)
                self.assertEqual(refused.exception.code, INVALID_PARAMS)

    def test_symbols_stay_the_default(self):
        scan, cloud = self.client.call("scan")
        self.assertNotIn("density", scan)
        self.assertIn(b"property float projector_u\n", cloud)

    def test_the_client_writes_every_file(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            out = pathlib.Path(folder)
            for name in ("a.ply", "a.pcd", "a.tiff", "a.tif"):
                done = slsctl("--socket", str(self.service.socket), "scan", str(out / name), "--density", "pixels", "--timeout-ms", "60000")
                self.assertEqual(done.returncode, 0, done.stderr)
            drawn = slsctl("--socket", str(self.service.socket), "scan", str(out / "b.ply"), "--density", "pixels", "--timeout-ms", "60000",
                           "--normals", "--cloud-picture", str(out / "b.png"))
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            _, points = ply((out / "a.ply").read_bytes())
            names, drawn_points = ply((out / "b.ply").read_bytes())
            self.assertEqual(names[6:], ["nx", "ny", "nz"])
            self.assertEqual([point[:18] for point in drawn_points], points)
            self.assertEqual(len(tiff_pages((out / "a.tiff").read_bytes())), 2)
            self.assertEqual(pcd((out / "a.pcd").read_bytes())[3], pcd(self.organised)[3])
            self.assertTrue((out / "b.png").read_bytes().startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main()
