#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""One scan as a mesh: what slsctl writes, as assimp and numpy read it."""
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "daemon"))

import numpy as np  # noqa: E402

from dense_test import pcd  # noqa: E402
from service import BIN, SCENE, Service, slsctl  # noqa: E402


def mesh_ply(bytes_):
    """Vertices and triangles of a mesh."""
    header, body = bytes_.split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode().split("\n")]
    vertices, faces = (int(line[2]) for line in lines if line[:1] == ["element"])
    layout = np.dtype([(line[2], {"float": "<f4", "uchar": "u1", "ushort": "<u2"}[line[1]]) for line in lines
                       if line[:1] == ["property"] and line[1] != "list"])
    points = np.frombuffer(body, layout, vertices)
    triangles = np.frombuffer(body[vertices * layout.itemsize:], np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    assert len(triangles) == faces and set(triangles["count"]) == {3}
    return points, triangles["corners"]


def obj(bytes_):
    """Places in mm, grey from 0 to 1, and triangles."""
    begin, end = bytes_.index(b"\nv ") + 1, bytes_.index(b"\nf ") + 1
    vertices = np.array(bytes_[begin:end].replace(b"v ", b"").split(), float).reshape(-1, 6)
    return vertices[:, :3], vertices[:, 3], np.array(bytes_[end:].replace(b"f ", b"").split(), int).reshape(-1, 3) - 1


def glb(bytes_):
    """The same."""
    length, = struct.unpack_from("<I", bytes_, 12)
    described = json.loads(bytes_[20:20 + length])

    def values(accessor, layout, width):
        view = described["bufferViews"][described["accessors"][accessor]["bufferView"]]
        from_ = 28 + length + view["byteOffset"]
        return np.frombuffer(bytes_[from_:from_ + view["byteLength"]], layout).reshape(-1, width)

    primitive, = described["meshes"][0]["primitives"]
    of = primitive["attributes"]
    return (values(of["POSITION"], "<f4", 3) * (1000.0, -1000, -1000), values(of["COLOR_0"], "u1", 4)[:, 0] / 255,
            values(primitive["indices"], "<u4", 3))


class Mesh(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        with cls.service.client() as client:
            _, cloud = client.call("scan", density="pixels", format="pcd", timeout_ms=60_000)
        cls.cloud = pcd(cloud)[3]

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def scan(self, name, *arguments):
        done = slsctl("--socket", self.service.socket, "scan", self.folder / name, "--timeout-ms", "600000", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / name

    def test_ply_has_the_points_and_joins_neighbours(self):
        points, triangles = mesh_ply(self.scan("a.ply", "--mesh").read_bytes())
        measured = self.cloud[~np.isnan(self.cloud["z"])]
        self.assertGreater(len(points), 0.95 * len(measured))
        self.assertGreater(len(triangles), 1.8 * len(points))
        known = {point.tobytes() for point in measured[["x", "y", "z", "sigma_mm"]].astype(
            [(name, "<f4") for name in ("x", "y", "z", "sigma_mm")])}
        self.assertTrue(all(point.tobytes() in known for point in points[["x", "y", "z", "sigma_mm"]].astype(
            [(name, "<f4") for name in ("x", "y", "z", "sigma_mm")])))
        self.assertEqual(len(np.unique(triangles)), len(points))
        corners = np.stack([points[axis] for axis in "xyz"], -1)[triangles].astype(float)
        distance = np.linalg.norm(corners, axis=-1).min(axis=-1)
        for i in range(3):
            self.assertTrue((np.linalg.norm(corners[:, i] - corners[:, i - 1], axis=-1) <= 0.00401 * distance).all())
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.assertTrue(((normals * corners.mean(axis=1)).sum(axis=-1) < 0).mean() > 0.999)
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        self.assertLessEqual(np.unique(edges, axis=0, return_counts=True)[1].max(), 2)

    def test_every_format_has_the_same_triangles(self):
        points, triangles = mesh_ply(self.scan("a.ply", "--mesh").read_bytes())
        corners = np.stack([points[axis] for axis in "xyz"], -1)[triangles].astype(float)
        stl = self.scan("a.stl").read_bytes()
        facets = np.frombuffer(stl[84:], np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]))
        np.testing.assert_array_equal(facets["corners"], corners.astype("<f4"))
        levels = points["red"][triangles] / 255
        for name, read in (("a.obj", obj), ("a.glb", glb)):
            with self.subTest(name=name):
                places, colours, faces = read(self.scan(name).read_bytes())
                self.assertEqual(faces.shape, triangles.shape)
                self.assertLess(abs(places[faces] - corners).max(), 0.002)
                self.assertLess(abs(colours[faces] - levels).max(), 0.001)

    def test_another_program_reads_what_is_written(self):
        counts = set()
        for name in ("a.ply", "a.stl", "a.obj", "a.glb"):
            done = subprocess.run(("assimp", "info", self.scan(name, "--mesh"), "--raw"), capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            counts.add(re.search(r"^Faces: +(\d+)", done.stdout, re.M)[1])
        self.assertEqual(len(counts), 1)
        self.assertGreater(int(counts.pop()), 100_000)

    def test_a_mesh_goes_to_standard_output_and_beside_a_picture(self):
        picture = self.folder / "p.png"
        done = subprocess.run((BIN / "slsctl", "--socket", self.service.socket, "scan", "-", "--format", "stl", "--cloud-picture",
                               picture, "--timeout-ms", "600000"), capture_output=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout), 84 + 50 * int.from_bytes(done.stdout[80:84], "little"))
        self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))

    def test_a_full_disk_leaves_the_file_before(self):
        """A limit on a file's size stands for the full disk: what probes the place before the scan fits, the cloud does not."""
        limited = "ulimit -f 128; trap '' XFSZ; exec \"$@\""
        for name in ("a.ply", "a.pcd", "a.stl", "a.obj", "a.glb", "a.tiff"):
            with self.subTest(name=name):
                file = self.folder / name
                file.write_text("before", encoding="utf-8")
                done = subprocess.run(("bash", "-c", limited, "bash", BIN / "slsctl", "--socket", self.service.socket, "scan", "-o", file,
                                       "--density", "pixels", "--timeout-ms", "600000"),
                                      capture_output=True, text=True, timeout=600, check=False)
                self.assertEqual(done.returncode, 1)
                self.assertEqual(done.stderr, f"slsctl: {file}: cannot write: File too large; free some space or choose another place\n")
                self.assertEqual(file.read_text(encoding="utf-8"), "before")
                file.unlink()
                self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_mesh_has_every_pixel_whatever_the_service_thins(self):
        whole = len(mesh_ply(self.scan("whole.ply", "--mesh").read_bytes())[1])
        self.assertEqual(slsctl("--socket", self.service.socket, "set", "cloud.stride=3", "cloud.voxel_mm=2").returncode, 0)
        self.addCleanup(slsctl, "--socket", self.service.socket, "set", "cloud.stride=default", "cloud.voxel_mm=default")
        self.assertEqual(len(mesh_ply(self.scan("thinned.ply", "--mesh").read_bytes())[1]), whole)
        self.scan("whole.ply", "--mesh", "--stride", "1", "--voxel-mm", "0")

    def test_what_has_no_mesh_is_refused(self):
        cases = {("a.stl", "--density", "symbols"): "a mesh needs --density pixels",
                 ("a.glb", "--normals"): "leave out --normals",
                 ("a.obj", "--stride", "2"): "leave out --stride and --voxel-mm",
                 ("a.ply", "--mesh", "--voxel-mm", "1"): "leave out --stride and --voxel-mm",
                 ("a.pcd", "--mesh"): ".ply, .stl, .obj or .glb",
                 ("a.tiff", "--mesh"): ".ply, .stl, .obj or .glb", ("--mesh",): "--mesh needs a file",
                 ("a.stl", "--format", "obj"): "does not match"}
        for arguments, expected in cases.items():
            with self.subTest(arguments=arguments):
                done = slsctl("--socket", self.service.socket, "scan", *arguments)
                self.assertEqual(done.returncode, 2)
                self.assertIn(expected, done.stderr)

    def test_a_scene_without_a_surface_gives_no_file(self):
        with Service(camera_path=SCENE / "dim.png") as service:
            done = slsctl("--socket", service.socket, "scan", self.folder / "a.stl", "--timeout-ms", "600000")
        self.assertEqual(done.returncode, 1)
        self.assertIn("there is no surface to write", done.stderr)
        self.assertIn("--why", done.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])


if __name__ == "__main__":
    unittest.main()
