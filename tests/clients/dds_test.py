#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds as the network sees it, on loopback: what it writes is read as bytes, by ROS's message definitions alone.

With SLSD_DDS_PYTHON, an interpreter that has Eclipse's package `cyclonedds` (pip install cyclonedds numpy), that reads the
same once more.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import colour_test  # noqa: E402
import robot_frame_test  # noqa: E402
import slsd  # noqa: E402
from dds_bridge import DOMAIN, FIELDS, RECORD, Bridge, Listener, States, matrix, probe, transforms, turn  # noqa: E402
from service import BIN, SCENE, Service, wait_until  # noqa: E402


class Shown(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.bridge = Bridge(cls.service, "--rate", "5", "--image-rate", "2")
        cls.addClassCleanup(cls.bridge.__exit__)
        cls.scanner = slsd.Scanner(cls.service.socket)
        cls.addClassCleanup(cls.scanner.close)

    def same_cloud(self, message):
        expected = self.scanner.scan().points
        self.assertEqual([message["height"], message["width"], message["point_step"], message["row_step"]],
                         [1, len(expected), 24, 24 * len(expected)])
        self.assertEqual([message["is_bigendian"], message["is_dense"]], [0, 1])
        self.assertEqual([tuple(field) for field in message["fields"]], FIELDS)
        self.assertEqual(message["header"]["frame_id"], "left_optical_frame")
        self.assertLess(abs(message["header"]["stamp"] - time.time()), 600)
        points = np.frombuffer(message["data"], RECORD)
        for ours, theirs in (("x", "x"), ("y", "y"), ("z", "z"), ("sigma", "sigma_mm")):
            np.testing.assert_array_equal(points[ours], expected[theirs] / np.float32(1000))
        for name in ("intensity", "camera"):
            np.testing.assert_array_equal(points[name], expected[name])

    def test_clouds_are_those_of_the_socket_in_metres(self):
        self.same_cloud(probe("left/points", "PointCloud2")[0].point_cloud())
        self.same_cloud(probe("left/points", "PointCloud2", "--best-effort")[0].point_cloud())

    def test_camera_info_is_the_calibration(self):
        calibration = self.scanner.settings()["calibration"]
        info = probe("left/camera/camera_info", "CameraInfo")[0].camera_info()
        k = matrix(calibration, "camera_matrix")
        self.assertEqual(info["k"], k)
        self.assertEqual(info["d"], matrix(calibration, "camera_distortion"))
        self.assertEqual(info["r"], [1, 0, 0, 0, 1, 0, 0, 0, 1])
        self.assertEqual(info["p"], [*k[0:3], 0, *k[3:6], 0, *k[6:9], 0])
        frame = self.scanner.frame()
        self.assertEqual((info["height"], info["width"]), frame.image.shape)
        self.assertEqual([info["distortion_model"], info["binning"], info["roi"]], ["plumb_bob", [0, 0], [0] * 5])
        self.assertEqual(info["header"]["frame_id"], "left_optical_frame")

    def test_images_are_the_frames(self):
        message = probe("left/camera/image_raw", "Image")[0].image()
        frame = self.scanner.frame().image
        self.assertEqual([message["height"], message["width"], message["step"], message["encoding"]],
                         [*frame.shape, frame.shape[1], "mono8"])
        np.testing.assert_array_equal(np.frombuffer(message["data"], np.uint8).reshape(frame.shape), frame)

    def test_the_optical_frame_hangs_on_the_scanners_body(self):
        transform = transforms()["left_optical_frame"]
        self.assertEqual(transform["header"]["frame_id"], "left_link")
        self.assertEqual(transform["translation"], [0, 0, 0])
        x, y, z, w = np.array(transform["rotation"])
        forward = np.array([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])  # of the optical z
        np.testing.assert_allclose(forward, [1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(np.abs([x, y, z, w]), 0.5, atol=1e-12)

    def test_the_projector_stands_where_the_calibration_has_it(self):
        calibration = self.scanner.settings()["calibration"]
        r, t = np.reshape(matrix(calibration, r"\bR"), (3, 3)), np.array(matrix(calibration, r"\bT"))
        transform = transforms()["left_projector_optical_frame"]
        self.assertEqual(transform["header"]["frame_id"], "left_optical_frame")
        np.testing.assert_allclose(transform["translation"], -r.T @ t / 1000, atol=1e-12)
        np.testing.assert_allclose(turn(transform["rotation"]), r.T, atol=1e-12)

    def test_the_robot_description_is_that_which_it_prints(self):
        (sample,) = probe("left/robot_description", "String", "--latched")
        printed = subprocess.run([BIN / "slsd-dds", "--name", "left", "--socket", self.service.socket, "--describe"],
                                 capture_output=True, text=True, timeout=600, check=True).stdout
        self.assertIn("left_projector_optical_frame", printed)
        self.assertEqual(sample.text(), printed)

    def test_diagnostics_tell_its_state(self):
        (status,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
        self.assertEqual((status["level"], status["name"], status["message"]), (0, "left: slsd", "ready to scan"))
        self.assertEqual(status["values"]["camera"], "ready")
        self.assertEqual(status["values"]["clouds lost before publishing"], "0")

    def test_the_trigger_service_scans(self):
        done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True, text=True,
                              timeout=120, check=True)
        self.assertRegex(done.stdout, rf"^1122334455667788 42 1 {len(self.scanner.scan())} points, scan ")

    def test_another_of_the_same_name_is_told(self):
        probe("left/points", "PointCloud2")  # it is there
        with Bridge(self.service) as second:
            self.assertEqual(second.process.wait(600), 1)
            self.assertIn("name_taken", second.said())

    def test_buffers_too_small_for_a_dense_cloud_are_told(self):
        allowed = int(pathlib.Path("/proc/sys/net/core/rmem_max").read_text(encoding="utf-8"))
        probe("left/points", "PointCloud2")  # it has begun
        self.assertEqual(f"net.core.rmem_max is {allowed}: " in self.bridge.said(), allowed < 10 << 20)

    def test_an_independent_reader_reads_the_same(self):
        python = os.environ.get("SLSD_DDS_PYTHON")
        if not python:
            self.skipTest("SLSD_DDS_PYTHON names no interpreter with cyclonedds")
        done = subprocess.run([python, HERE / "dds_reader.py", str(DOMAIN)], capture_output=True, text=True, timeout=120,
                              check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        read = json.loads(done.stdout)
        cloud = read["points"]
        cloud["header"]["stamp"] = cloud["header"]["stamp"]["sec"] + cloud["header"]["stamp"]["nanosec"] * 1e-9
        cloud["data"] = bytes.fromhex(cloud["data"])
        cloud["fields"] = [tuple(field[key] for key in ("name", "offset", "datatype", "count"))
                           for field in cloud["fields"]]
        self.same_cloud(cloud)
        info = probe("left/camera/camera_info", "CameraInfo")[0].camera_info()
        for key in ("height", "width", "distortion_model", "d", "k", "r", "p"):
            self.assertEqual(read["info"][key], info[key], key)
        self.assertEqual([read["info"]["binning_x"], read["info"]["binning_y"]], info["binning"])
        self.assertEqual([int(value) for value in read["info"]["roi"].values()], info["roi"])
        self.assertEqual(read["info"]["header"]["frame_id"], info["header"]["frame_id"])
        image = probe("left/camera/image_raw", "Image")[0].image()
        read["image"]["data"] = bytes.fromhex(read["image"]["data"])
        for key in ("height", "width", "encoding", "is_bigendian", "step", "data"):
            self.assertEqual(read["image"][key], image[key], key)
        (status,) = read["diagnostics"]["status"]
        (expected,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
        for key in ("level", "name", "message", "hardware_id"):
            self.assertEqual(status[key], expected[key], key)
        self.assertEqual([pair["key"] for pair in status["values"]], list(expected["values"]))
        self.assertEqual({pair["key"]: pair["value"] for pair in status["values"]}["camera"], "ready")
        self.assertEqual((read["trigger"]["client_guid"], read["trigger"]["sequence_number"], read["trigger"]["success"]),
                         (0x1122334455667788, 7, True))
        self.assertRegex(read["trigger"]["message"], rf"^{len(self.scanner.scan())} points, scan ")
        self.assertEqual(len(read["transforms"]["transforms"]), len(transforms()))
        for transform in read["transforms"]["transforms"]:
            expected = transforms()[transform["child_frame_id"]]
            self.assertEqual(transform["header"]["frame_id"], expected["header"]["frame_id"])
            self.assertEqual(list(transform["transform"]["rotation"].values()), expected["rotation"])
            self.assertEqual(list(transform["transform"]["translation"].values()), expected["translation"])


class Thinned(unittest.TestCase):
    def shown(self, density, *more):
        """What is published of a scan, and the whole of it in metres."""
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            whole = scanner.scan(density=density, timeout_s=60).points
            with Bridge(service, "--rate", "2", "--density", density, *more):
                message = probe("left/points", "PointCloud2")[0].point_cloud()
        return np.frombuffer(message["data"], RECORD), whole

    def test_by_voxels_has_the_first_point_of_each(self):
        points, whole = self.shown("symbols", "--voxel", "50")
        cells = np.floor(np.stack([whole[axis] for axis in "xyz"], axis=1).astype(float) / 50)
        _, first = np.unique(cells, axis=0, return_index=True)
        self.assertLess(len(first), len(whole) / 2)
        for axis in "xyz":
            np.testing.assert_array_equal(points[axis], whole[axis][np.sort(first)] / np.float32(1000))

    def test_by_tiny_voxels_has_all_points(self):
        for voxel in ("0.0001", "1e-30"):
            points, whole = self.shown("symbols", "--voxel", voxel)
            self.assertEqual(len(points), len(whole))

    def test_by_stride_has_every_third_pixel_of_every_third_row(self):
        points, whole = self.shown("pixels", "--stride", "3")
        self.assertAlmostEqual(len(points) / len(whole), 1 / 9, delta=0.01)
        every = {tuple(point) for point in np.stack([whole[axis] / np.float32(1000) for axis in "xyz"], axis=1).tolist()}
        self.assertTrue(every.issuperset(map(tuple, np.stack([points[axis] for axis in "xyz"], axis=1).tolist())))

    def test_to_what_may_leave_says_so_and_counts_the_rest(self):
        with Service() as service, Bridge(service, "--density", "pixels", "--stride", "4", "--rate-max", "1") as bridge, \
                States() as states, Listener("left/points", "PointCloud2") as clouds:
            clouds.next()
            clouds.next()
            wait_until(lambda: int(states.samples.get("left: slsd", {"values": {"clouds lost before publishing": "0"}})["values"]
                                   ["clouds lost before publishing"]) > 2, "that clouds are lost")
            self.assertEqual(bridge.said().count("clouds exceed the rate limit"), 1)


class Coloured(unittest.TestCase):
    def triggered(self, camera_path, *options):
        """What the trigger answers, and the cloud that came of it, beside the same scan of the socket."""
        with Service(camera_path=camera_path) as service, slsd.Scanner(service.socket) as scanner, \
                Bridge(service, "--rate", "0", "--colour", *options), Listener("left/points", "PointCloud2") as clouds:
            done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True,
                                  text=True, timeout=120, check=True)
            if " points, scan " not in done.stdout:
                return done.stdout, None, None
            wait_until(lambda: clouds.count > 0, "a cloud")
            density = "pixels" if "pixels" in options else "symbols"
            return done.stdout, clouds.samples[""].point_cloud(), \
                scanner.scan(colour=True, density=density, timeout_s=60).points

    def frames(self, **pictures):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(folder.cleanup)
        shutil.copy(SCENE / "frame.png", folder.name)
        for name, picture in pictures.items():
            (pathlib.Path(folder.name) / name).mkdir()
            (pathlib.Path(folder.name) / name / "0.ppm").write_bytes(b"P6 1600 1200 255\n" + picture.tobytes())
        return folder.name

    def test_triggered_scans_are_those_of_the_socket(self):
        white = colour_test.gradient(1600, 1200)
        for options in ((), ("--density", "pixels", "--stride", "1")):
            _, message, expected = self.triggered(self.frames(white=white), *options)
            self.assertEqual([tuple(field) for field in message["fields"]], [*FIELDS, ("rgb", 24, 7, 1)])
            self.assertEqual([message["width"], message["point_step"], message["row_step"]],
                             [len(expected), 28, 28 * len(expected)])
            points = np.frombuffer(message["data"], np.dtype([*RECORD.descr, ("rgb", "<u4")]))
            np.testing.assert_array_equal(points["x"], expected["x"] / np.float32(1000))
            np.testing.assert_array_equal(
                points["rgb"], expected["red"].astype("u4") << 16 | expected["green"].astype("u4") << 8 | expected["blue"])
            self.assertGreater(len(np.unique(points["rgb"])), 1000)

    def test_a_camera_without_colours_is_answered_by_name(self):
        white = np.full((1200, 1600), 200, np.uint8)
        folder = self.frames()
        (pathlib.Path(folder) / "white").mkdir()
        (pathlib.Path(folder) / "white" / "0.pgm").write_bytes(b"P5 1600 1200 255\n" + white.tobytes())
        answer, message, _ = self.triggered(folder)
        self.assertIsNone(message)
        self.assertIn(" 0 unsupported: ", answer)


class InTheRobotsBase(unittest.TestCase):
    def shown(self, mounted, *more, **scan):
        """A published cloud, and the scan of the socket, in the frame as configured."""
        service = Service(configuration=robot_frame_test.CONFIGURATION.format(
            scene=SCENE, frame='output = "robot_base"\nhand_eye = "hand_eye.yml"'))
        (service.folder / "hand_eye.yml").write_text(robot_frame_test.hand_eye(mounted), encoding="utf-8")
        with service, slsd.Scanner(service.socket) as scanner:
            whole = scanner.scan(density="pixels", timeout_s=60, **scan)
            with Bridge(service, "--rate", "2", "--density", "pixels", *more):
                message = probe("left/points", "PointCloud2")[0].point_cloud()
        return message["header"]["frame_id"], np.frombuffer(message["data"], RECORD), whole

    def check(self, points, whole):
        """Every second pixel of every second row is there, nothing else."""
        self.assertAlmostEqual(len(points) / len(whole.points), 1 / 4, delta=0.01)
        every = {tuple(point) for point in np.stack([whole.points[axis] / np.float32(1000) for axis in "xyz"], axis=1).tolist()}
        self.assertTrue(every.issuperset(map(tuple, np.stack([points[axis] for axis in "xyz"], axis=1).tolist())))

    def test_with_the_scanner_in_the_cell(self):
        frame, points, whole = self.shown("cell", "--robot-base", "ur10_base")
        self.assertEqual(frame, "ur10_base")
        np.testing.assert_allclose(np.reshape(whole.description["base_from_rig"], (4, 4)), robot_frame_test.MOUNT, atol=1e-6)
        self.check(points, whole)

    def test_with_the_scanner_on_the_arm_clouds_stay_with_the_scanner(self):
        frame, points, whole = self.shown("arm", coordinate_frame="rig")
        self.assertEqual(frame, "left_optical_frame")
        self.check(points, whole)


class Empty(unittest.TestCase):
    def test_clouds_say_why(self):
        with Service(camera_path=SCENE / "black.png") as dark, Bridge(dark, "--rate", "5"), States() as states:
            done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True, text=True,
                                  timeout=120, check=True)
            self.assertRegex(done.stdout, r" 1 0 points, scan \S+: no symbol of the pattern was decoded")
            wait_until(lambda: states.samples.get("left: slsd", {}).get("message", "").startswith(
                "the last cloud is empty: no symbol of the pattern was decoded"), "why it is empty")
            self.assertEqual(states.samples["left: slsd"]["level"], 1)


class ExtrinsicsFile(unittest.TestCase):
    def write(self, text):
        file = tempfile.NamedTemporaryFile("w", suffix=".toml", delete=False)
        self.addCleanup(os.unlink, file.name)
        with file:
            file.write(text)
        return file.name

    GOOD = 'parent = "cell"\n[scanner.left]\nrotation = [0, -1, 0, 1, 0, 0, 0, 0, 1]\ntranslation_mm = [100, 0, 50]\n'

    def test_that_does_not_hold_is_refused_by_name(self):
        with Service() as service:
            for text, name in (("parent = \"cell\"\n", "extrinsics_missing"), ("nonsense", ":1"),
                               (self.GOOD.replace("[0, -1", "[0, -2"), "not a rotation"),
                               (self.GOOD.replace("100, 0, 50", "100, 0"), "3 numbers")):
                with Bridge(service, "--extrinsics", self.write(text)) as bridge:
                    self.assertEqual(bridge.process.wait(600), 1)
                    self.assertIn(name, bridge.said())

    def test_says_where_the_scanner_stands(self):
        with Service() as service, Bridge(service, "--extrinsics", self.write(self.GOOD), "--rate", "0"):
            transform = transforms()["left_optical_frame"]
            self.assertEqual(transform["header"]["frame_id"], "cell")
            np.testing.assert_allclose(transform["translation"], [0.1, 0, 0.05])
            np.testing.assert_allclose(transform["rotation"], [0, 0, 0.5**0.5, 0.5**0.5], atol=1e-12)

    def test_of_another_calibration_places_nothing(self):
        stale = self.write(self.GOOD + 'calibration_date = "2001-01-01T00:00:00Z"\n')
        with Service() as service, Bridge(service, "--extrinsics", stale, "--rate", "0"):
            self.assertEqual(list(transforms()), ["left_projector_optical_frame"])  # by the camera, not in the cell
            (status,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
            self.assertEqual(status["level"], 2)
            self.assertIn("extrinsics_stale", status["message"])


class Usage(unittest.TestCase):
    def test_that_is_misspelt_is_answered_with_the_nearest(self):
        for words, hint in ((["--intefrace", "lo"], "did you mean --interface?"), (["--density", "pixel"], "did you mean pixels?"),
                            (["--stride", "0"], '"0" is not a number from 1 to 16'),
                            (["--name", "--rate"], "a value is missing before --rate"),
                            (["--scanner", "left"], "--scanner needs --merge"), (["left"], 'unexpected argument "left"')):
            done = subprocess.run([BIN / "slsd-dds", *words], capture_output=True, text=True, timeout=600, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn(hint, done.stderr)


if __name__ == "__main__":
    unittest.main()
