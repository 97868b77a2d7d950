#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A point for each camera pixel: what a request gets, in every format, and what is refused."""
import pathlib
import shutil
import struct
import tempfile
import unittest

import numpy as np

from client import RpcError
from record_test import lines_of, measured, two_cameras
from service import SCENE, Service, slsctl

INVALID_PARAMS = -32602
NO_POINT = b"\x00\x00\xc0\x7f"
PIXELS = '\n[decode]\ndensity = "pixels"\n'
PIXEL_SCAN = {"density": "pixels", "timeout_ms": 60_000}
OTHER_PATTERN = """
[pattern]
seed = 7
[[camera]]
name = "camera"
path = "{scene}/frame.png"
[calibration]
file = "{scene}/calibration.yml"
[server]
socket = "slsd.sock"
"""


def layout_of(names, types, sizes):
    """The record of a cloud's file."""
    kinds = {("F", 4): "<f4", ("U", 1): "u1", ("float", 4): "<f4", ("uchar", 1): "u1"}
    return np.dtype([(name, kinds[kind, size]) for name, kind, size in zip(names, types, sizes, strict=True)])


def ply(bytes_):
    """The properties' names, and the records."""
    header, body = bytes_.split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode().split("\n")]
    count = next(int(line[2]) for line in lines if line[:2] == ["element", "vertex"])
    types, names = zip(*(line[1:] for line in lines if line[:1] == ["property"]))
    records = np.frombuffer(body, layout_of(names, types, [4 if kind == "float" else 1 for kind in types]))
    assert len(records) == count, (len(records), count)
    return list(names), records


def pcd(bytes_):
    header, body = bytes_.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in header.decode().split("\n") if line and not line.startswith("#"))
    width, height = int(fields["WIDTH"]), int(fields["HEIGHT"])
    layout = layout_of(fields["FIELDS"].split(), fields["TYPE"].split(), map(int, fields["SIZE"].split()))
    records = np.frombuffer(body, layout)
    assert len(records) == width * height
    return fields, width, height, records


def as_ply(records):
    """The points of a PCD as a PLY has them: intensity is a byte, normals have shorter names, and no pixel is empty."""
    measured = records[~np.isnan(records["z"])]
    names = [name.replace("normal_", "n") for name in measured.dtype.names]
    kinds = ["u1" if name == "intensity" else measured.dtype[i] for i, name in enumerate(names)]
    points = np.empty(len(measured), np.dtype(list(zip(names, kinds))))
    for name, of_pcd in zip(names, measured.dtype.names):
        points[name] = measured[of_pcd]
    return points


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
        pixels = np.frombuffer(bytes_, "<f4", tags[256] * tags[257], tags[273])
        pages.append((tags[256], tags[257], pixels))
        at = struct.unpack_from("<I", bytes_, at + 2 + 12 * count)[0]
    return pages


def assert_same_surface(test, cloud, single):
    """Where nothing moves, a stream measures from frame to frame: the same pixels, and to well within their sigma."""
    one, other = pcd(cloud)[3], pcd(single)[3]
    there, single_there = ~np.isnan(one["z"]), ~np.isnan(other["z"])
    both = there & single_there
    far = np.abs(one["z"] - other["z"])[both] > 0.5 * one["sigma_mm"][both]
    test.assertGreater(both.sum(), 0.98 * (there | single_there).sum())
    test.assertLess(far.sum(), 0.01 * both.sum())


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
        self.assertEqual((fields["SIZE"], fields["TYPE"]), ("4 4 4 4 4 1", "F F F F F U"))  # PCL's intensity is a float
        self.assertGreater(len(np.unique(records["intensity"])), 10)
        self.assertEqual(as_ply(records).tobytes(), points.tobytes())
        empty = records[np.isnan(records["z"])]
        self.assertEqual(empty.tobytes(), len(empty) * (4 * NO_POINT + b"\0\0\0\0\0"))
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, format="tiff")
        (width_z, height_z, depth), (_, _, sigma) = tiff_pages(cloud)
        self.assertEqual((width_z, height_z), (width, height))
        np.testing.assert_array_equal(depth, records["z"])
        np.testing.assert_array_equal(np.isnan(sigma), np.isnan(depth))

    def test_normals_face_the_camera(self):
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, normals=True)
        names, points = ply(cloud)
        self.assertEqual(names[6:], ["nx", "ny", "nz"])
        at, normals = (np.stack([points[name] for name in of], axis=1) for of in (("x", "y", "z"), ("nx", "ny", "nz")))
        np.testing.assert_allclose((normals ** 2).sum(axis=1), 1, atol=1e-4)
        self.assertTrue(((normals * at).sum(axis=1) < 0).all())
        _, cloud = self.client.call("scan", density="pixels", timeout_ms=60_000, normals=True, format="pcd")
        fields, _, _, records = pcd(cloud)
        self.assertEqual(fields["FIELDS"].split()[6:], ["normal_x", "normal_y", "normal_z"])
        self.assertEqual(as_ply(records).tobytes(), points.tobytes())

    def test_what_does_not_go_together_is_refused(self):
        for params in ({"format": "tiff"}, {"normals": True}, {"density": "symbols", "normals": True},
                       {"density": "pixels", "format": "tiff", "normals": True}, {"density": "voxels"}):
            for method in ("scan", "subscribe"):
                with self.assertRaises(RpcError) as refused:
                    self.client.call(method, **params)
                self.assertEqual(refused.exception.code, INVALID_PARAMS)

    def test_memfd_holds_the_same_bytes(self):
        with self.service.client() as client:
            scan, memory = client.call_for_descriptor("scan", transport="memfd", format="pcd", **PIXEL_SCAN)
            with memory:
                cloud = memory.read()
        self.assertEqual(scan["memfd_bytes"], len(cloud))
        assert_same_surface(self, cloud, self.organised)

    def test_subscriber_gets_clouds_of_pixels(self):
        with self.service.client() as client:
            told, _ = client.call("subscribe", density="pixels", format="pcd")
            self.assertEqual(told["density"], "pixels")
            for _ in range(2):
                event, cloud = client.receive()
                self.assertEqual((event["method"], event["params"]["density"]), ("cloud", "pixels"))
                assert_same_surface(self, cloud, self.organised)

    def test_subscriber_gets_memfds(self):
        with self.service.client() as client:
            client.call("subscribe", density="pixels", transport="memfd", format="pcd")
            frames = []
            for _ in range(3):
                event, memory = client.receive_with_descriptor()
                with memory:
                    cloud = memory.read()
                self.assertEqual(event["params"]["memfd_bytes"], len(cloud))
                self.assertNotIn("bytes", event["params"])
                assert_same_surface(self, cloud, self.organised)
                frames.append(event["params"]["frame"])
            self.assertEqual(frames, sorted(set(frames)))

    def test_two_subscribers_get_memfds_of_their_own(self):
        with self.service.client() as one, self.service.client() as other:
            for client in (one, other):
                client.call("subscribe", density="pixels", transport="memfd", format="pcd")
            for client in (one, other):
                for _ in range(2):
                    event, memory = client.receive_with_descriptor()
                    with memory:
                        cloud = memory.read()
                    self.assertEqual(event["params"]["memfd_bytes"], len(cloud))
                    assert_same_surface(self, cloud, self.organised)

    def test_subscriber_that_keeps_memfds_gets_no_more(self):
        """Two of them, and then the newest once one is given back."""
        with self.service.client() as client, self.service.client() as other:
            client.call("subscribe", density="pixels", transport="memfd")
            kept = [client.receive_with_descriptor()[1] for _ in range(2)]
            before = other.call("status")[0]["scans"]["succeeded"]
            for _ in range(2):
                other.call("scan", **PIXEL_SCAN)
            self.assertGreater(other.call("status")[0]["scans"]["succeeded"], before)
            for memory in kept:
                memory.close()
            event, memory = client.receive_with_descriptor()
            memory.close()
            self.assertEqual(event["method"], "cloud")
            self.assertGreater(event["params"]["lost"], 0)

    def test_how_far_off_its_epipolar_lines_it_is(self):
        scan, _ = self.client.call("scan", **PIXEL_SCAN)
        self.assertEqual(len(scan["epipolar_px"]), 1)
        self.assertLess(abs(scan["epipolar_px"][0]), 0.03)
        self.assertNotIn("empty", scan)

    def test_symbols_stay_the_default(self):
        scan, cloud = self.client.call("scan")
        self.assertNotIn("density", scan)
        self.assertIn(b"property float projector_u\n", cloud)

    def test_the_client_writes_every_file(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            out = pathlib.Path(folder)
            for name in ("a.ply", "a.pcd", "a.tiff", "a.tif"):
                done = slsctl("--socket", str(self.service.socket), "scan", str(out / name), "--density", "pixels", "--timeout-ms", "600000")
                self.assertEqual(done.returncode, 0, done.stderr)
            drawn = slsctl("--socket", str(self.service.socket), "scan", str(out / "b.ply"), "--density", "pixels", "--timeout-ms", "600000",
                           "--normals", "--cloud-picture", str(out / "b.png"))
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            _, points = ply((out / "a.ply").read_bytes())
            names, drawn_points = ply((out / "b.ply").read_bytes())
            self.assertEqual(names[6:], ["nx", "ny", "nz"])
            for name in points.dtype.names:
                np.testing.assert_array_equal(drawn_points[name], points[name])
            again = ply(self.client.call("scan", normals=True, **PIXEL_SCAN)[1])[1]
            self.assertEqual(drawn_points.tobytes(), again.tobytes())
            self.assertEqual(len(tiff_pages((out / "a.tiff").read_bytes())), 2)
            self.assertEqual(pcd((out / "a.pcd").read_bytes())[3].tobytes(), pcd(self.organised)[3].tobytes())
            self.assertTrue((out / "b.png").read_bytes().startswith(b"\x89PNG"))


class DenseElsewhere(unittest.TestCase):
    """With services of their own."""

    def folder(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        return pathlib.Path(temporary.name)

    def test_recording_replays_byte_for_byte(self):
        recording = self.folder() / "recording"
        with Service(camera=PIXELS) as service:
            done = slsctl("--socket", service.socket, "record", recording, "--frames", "1", "--clouds", "--timeout-ms", "600000")
            self.assertEqual(done.returncode, 0, done.stderr)
        again = Service(configuration=(recording / "slsd.toml").read_text(encoding="utf-8"))
        shutil.copytree(recording, again.folder, dirs_exist_ok=True)
        with again, again.client() as client:
            scan, cloud = client.call("scan", timeout_ms=60_000)
        self.assertEqual(scan["density"], "pixels")
        line, = lines_of(recording)
        recorded = (recording / line["cloud"]).read_bytes()
        self.assertGreater(scan["points"], 100_000)
        self.assertEqual(measured(recorded), measured(cloud))

    def test_cameras_stand_one_below_the_other(self):
        with Service() as one, one.client() as client:
            told, pixels = client.call("frame", format="raw")
        with two_cameras(pixels, told["width_px"], told["height_px"]) as service, service.client() as client:
            scan, cloud = client.call("scan", format="pcd", **PIXEL_SCAN)
            _, width, height, records = pcd(cloud)
            self.assertEqual((width, height), (1600, 2400))
            self.assertEqual(len(scan["epipolar_px"]), 2)
            self.assertEqual(sum(scan["pixels"].values()), width * height)
            first, second = np.split(records["camera"], 2)
            self.assertEqual((set(first), set(second)), ({0}, {1}))
            _, depth_maps = client.call("scan", format="tiff", **PIXEL_SCAN)
            self.assertEqual([page[:2] for page in tiff_pages(depth_maps)], 4 * [(1600, 1200)])

    def test_texture_colours_every_pixel(self):
        frames = self.folder() / "frames"
        for name, image in (("0", "frame"), ("white/0", "grey"), ("dark/0", "dim")):
            (frames / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SCENE / (image + ".png"), frames / (name + ".png"))
        with Service(camera_path=frames) as service, service.client() as client:
            scan, cloud = client.call("scan", texture=True, ambient=True, **PIXEL_SCAN)
            self.assertGreater(scan["points"], 100_000)
            self.assertEqual(set(ply(cloud)[1]["intensity"]), {60})
            self.assertEqual(scan["saturated"], 0)
            self.assertLess(scan["white_differs"], 0.1)

    def test_white_that_is_of_another_scene_is_told(self):
        frames = self.folder() / "frames"
        for name, image in (("0", "frame"), ("white/0", "frame")):
            (frames / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SCENE / (image + ".png"), frames / (name + ".png"))
        with Service(camera_path=frames) as service, service.client() as client:
            scan, _ = client.call("scan", texture=True, **PIXEL_SCAN)
            if scan["points"]:
                self.assertGreater(scan["white_differs"], 0.2)

    def test_empty_cloud_says_why(self):
        dark = Service(camera_path=SCENE / "black.png")
        other = Service(configuration=OTHER_PATTERN.format(scene=SCENE))
        for each in (dark, other):
            with each as service, service.client() as client:
                scan, cloud = client.call("scan", **PIXEL_SCAN)
                self.assertEqual((scan["points"], len(ply(cloud)[1])), (0, 0))
                self.assertEqual(scan["pixels"]["not_reached"], scan["width_px"] * scan["height_px"])
                self.assertIn("no symbol of the pattern was decoded", scan["empty"])


if __name__ == "__main__":
    unittest.main()
