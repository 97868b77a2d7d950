#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The methods and options of the Python client: what they do, and that a type checker knows them."""
import gc
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import typing
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PACKAGE = ROOT / "clients/python"
sys.path[:0] = [str(PACKAGE), str(HERE.parent / "daemon"), str(HERE)]

import numpy as np  # noqa: E402

import patience  # noqa: E402, F401
import slsd  # noqa: E402
from impostor import Impostor, ply, result  # noqa: E402
from service import Service  # noqa: E402


class OnAService(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.service.wait_ready()

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.scanner = slsd.Scanner(self.service.socket)
        self.addCleanup(self.scanner.close)


class Saving(OnAService):
    def test_a_cloud_gives_the_service_s_own_bytes(self):
        with self.service.client() as client:
            for params in ({}, {"density": "pixels", "normals": True, "timeout_ms": 60000}):
                data = client.call("scan", format="ply", **params)[1]
                slsd.read_ply(data).save(self.folder / "cloud.ply")
                self.assertEqual((self.folder / "cloud.ply").read_bytes(), data)
        self.assertEqual(os.listdir(self.folder), ["cloud.ply"])

    def test_a_part_of_a_cloud_is_a_cloud(self):
        cloud = self.scanner.scan()
        near = slsd.Cloud(cloud.points[cloud.points["z"] < np.median(cloud.points["z"])], cloud.comments, cloud.description)
        near.save(self.folder / "near.PLY")
        read = slsd.read_ply((self.folder / "near.PLY").read_bytes())
        np.testing.assert_array_equal(read.points, near.points)
        self.assertEqual(read.comments, cloud.comments)
        near.save(str(self.folder / "text.ply"))
        for name in ("cloud.pcd", "cloud"):
            with self.assertRaisesRegex(ValueError, "must end in .ply"):
                near.save(self.folder / name)
        with self.assertRaisesRegex(ValueError, "'count'"):
            slsd.Cloud(np.zeros(2, [("x", "<f4"), ("count", "<i8")]), {}, {}).save(self.folder / "wide.ply")

    def test_a_scan_has_the_format_of_its_name(self):
        begins = {"a.ply": b"ply\n", "b.PCD": b"# .PCD", "c.tif": b"II*\0", "d.tiff": b"II*\0"}
        for name, begin in begins.items():
            told = self.scanner.save(self.folder / name, density="pixels", timeout_s=60)
            self.assertTrue((self.folder / name).read_bytes().startswith(begin), name)
            self.assertGreater(told["points"], 0)
        self.assertEqual(sorted(os.listdir(self.folder)), sorted(begins))

    def test_what_cannot_be_written_is_told_before_the_scan_and_leaves_nothing(self):
        before = self.scanner.status()["scans"]["succeeded"]
        with self.assertRaisesRegex(ValueError, ".ply, .pcd, .tiff"):
            self.scanner.save(self.folder / "cloud.xyz")
        with self.assertRaises(FileNotFoundError):
            self.scanner.save(self.folder / "nowhere" / "cloud.ply")
        with self.assertRaises(slsd.InvalidRequest):
            self.scanner.save(self.folder / "cloud.tiff", density="symbols")
        self.assertEqual(self.scanner.status()["scans"]["succeeded"], before)
        self.assertEqual(os.listdir(self.folder), [])


class Options(OnAService):
    def test_of_time_are_within_the_protocol_s_or_named(self):
        for call in (self.scanner.scan, self.scanner.frame, self.scanner.preview, lambda **of: self.scanner.project("white", **of),
                     lambda **of: self.scanner.save(self.folder / "cloud.ply", **of)):
            for seconds in (0, 0.0, -1, 0.0004, 600.1, float("nan"), float("inf")):
                with self.assertRaisesRegex(slsd.InvalidRequest, "timeout_s must be 0.001 to 600 seconds, or None") as caught:
                    call(timeout_s=seconds)
                self.assertEqual((caught.exception.name, caught.exception.where), ("invalid_params", "timeout_s"))
        asked = []

        def answer(request):
            asked.append(request["params"].get("timeout_ms"))
            return result(request, ply(1), bytes=len(ply(1)))

        with Impostor(answer) as service, slsd.Scanner(service.path) as scanner:
            for seconds in (None, 0.001, 5, np.float32(60), 600):
                scanner.scan(timeout_s=seconds)
        self.assertEqual(asked, [None, 1, 5000, 60000, 600000])
        with self.assertRaisesRegex(slsd.InvalidRequest, "more than 0"):
            self.scanner.stream(idle_s=0)

    def test_that_json_has_no_value_for_are_named_and_break_nothing(self):
        for rate in (float("nan"), object()):
            with self.assertRaisesRegex(slsd.InvalidRequest, "subscribe: a parameter is not valid in JSON"):
                next(self.scanner.stream(rate_hz=rate))
        self.assertGreater(len(next(self.scanner.stream(rate_hz=np.float32(30)))), 0)

    def test_of_a_scan_reach_the_service(self):
        dense = self.scanner.scan(density="pixels", normals=True, shared=False, timeout_s=60)
        self.assertEqual(dense.description["format"], "ply")
        self.assertIn("bytes", dense.description)
        np.testing.assert_allclose(np.linalg.norm(dense.normals, axis=1), 1, atol=1e-4)
        with self.assertRaises(slsd.NotFound):
            self.scanner.scan(picture=True, camera="nobody")
        streamed = next(self.scanner.stream(density="pixels", normals=True, shared=True))
        self.assertIn("memfd_bytes", streamed.description)
        self.assertEqual(len(streamed.normals), len(streamed))

    def test_are_none_that_are_not_known(self):
        for call in (self.scanner.scan, self.scanner.stream, self.scanner.set):
            with self.assertRaises(TypeError):
                call(dencity="pixels")


class Settings(OnAService):
    def test_are_in_force_at_once_and_taken_back(self):
        told = self.scanner.set(decode={"depth_max_mm": 600.0})
        self.assertEqual(told["set"], {"decode": {"depth_max_mm": 600.0}})
        self.assertEqual(len(self.scanner.scan()), 0)  # the plane is at 2 m
        self.assertEqual(self.scanner.set(decode={"depth_max_mm": None})["set"], {})
        self.assertGreater(len(self.scanner.scan()), 0)
        with self.assertRaisesRegex(slsd.InvalidRequest, "depth_max"):
            self.scanner.set(decode={"depth_max": 600.0})

    def test_of_a_camera_that_has_none_are_refused(self):
        self.assertEqual(self.scanner.exposure(), slsd.Exposure("camera", None, None))
        with self.assertRaises(slsd.ScannerError):
            self.scanner.exposure("camera", gain_db=3.0)
        with self.assertRaisesRegex(slsd.NotFound, "'left' .configured: camera."):
            self.scanner.exposure("left")

    def test_of_a_camera_are_read_back(self):
        cameras = [{"name": "left", "exposure_us": 8000.0, "gain_db": 0.0}, {"name": "right", "exposure_us": 8000.0}]

        def answer(request):
            if request["method"] == "set":
                for name, keys in request["params"]["camera"].items():
                    next(each for each in cameras if each["name"] == name).update(keys)
            return result(request, cameras=cameras)

        with Impostor(answer) as service, slsd.Scanner(service.path) as scanner:
            self.assertEqual(scanner.exposure("right", exposure_us=16700.0), slsd.Exposure("right", 16700.0, None))
            self.assertEqual(scanner.exposure(exposure_us=12000.0, gain_db=0), slsd.Exposure("left", 12000.0, 0))
            self.assertEqual(scanner.exposure("right").exposure_us, 16700.0)


class Calibrating(OnAService):
    STATES = [{"number": 1, "under_way": True, "progress": {"state": "starting"}},
              {"number": 1, "under_way": True, "progress": {"state": "starting"}},
              {"number": 2, "under_way": True, "progress": {"state": "taken", "poses": 1, "wanted": 8}},
              {"number": 3, "under_way": False, "error": None, "outcome": {"grade": "good"}}]

    def session(self, *states):
        """A service whose session goes through these, and what it was asked for."""
        left, asked = list(states), []

        def answer(request):
            asked.append(request["params"])
            return result(request, **(left.pop(0) if len(left) > 1 else left[0]))

        service = Impostor(answer)
        self.addCleanup(service.__exit__)
        return service, asked

    def test_ends_when_it_is_in_force_and_tells_what_changed(self):
        service, asked = self.session(*self.STATES)
        told = []
        with slsd.Scanner(service.path) as scanner:
            outcome = scanner.calibrate(board="charuco:8x5:30:22", code="gray", poses=8, told=told.append)
        self.assertEqual(outcome["outcome"]["grade"], "good")
        self.assertEqual(asked, [{"action": "begin", "board": "charuco:8x5:30:22", "code": "gray", "poses": 8}] +
                         [{"action": "look"}] * 3)
        self.assertEqual([state["number"] for state in told], [1, 2, 3])

    def test_that_comes_to_nothing_is_an_error(self):
        service, _ = self.session(self.STATES[0], {"number": 2, "under_way": False, "error": "no board was seen"})
        with slsd.Scanner(service.path) as scanner, self.assertRaisesRegex(slsd.ScannerError, "no board was seen"):
            scanner.calibrate()

    def test_is_given_up_when_its_program_is(self):
        def stop(state):
            raise KeyboardInterrupt

        service, asked = self.session(self.STATES[0])
        with slsd.Scanner(service.path) as scanner, self.assertRaises(KeyboardInterrupt):
            scanner.calibrate(told=stop)
        self.assertEqual([params["action"] for params in asked], ["begin", "cancel"])

    def test_is_begun_and_looked_at_on_the_service(self):
        self.assertFalse(self.scanner.calibration()["under_way"])
        with self.assertRaisesRegex(slsd.NotFound, "STATE_DIRECTORY"):
            self.scanner.calibrate()
        with self.assertRaises(slsd.InvalidRequest):
            self.scanner.calibrate(poses=2)


class Memory(unittest.TestCase):
    def test_that_is_used_up_is_told_with_what_gives_it_back(self):
        with Service(server="memory_max_mb = 256") as service, slsd.Scanner(service.socket) as scanner:
            held = []
            with self.assertRaisesRegex(slsd.Busy, r"still holds \d+ clouds? in shared memory: .*`del cloud`.*shared=False") as caught:
                for _ in range(64):
                    held.append(scanner.scan(density="pixels", timeout_s=60))
            self.assertEqual(caught.exception.name, "busy")
            self.assertIn(f"holds {len(held)} cloud", str(caught.exception))
            self.assertGreater(len(scanner.scan(density="pixels", timeout_s=60, shared=False)), 0)
            held.pop()
            gc.collect()
            self.assertGreater(len(scanner.scan(density="pixels", timeout_s=60)), 0)

    def test_of_others_is_not_blamed_on_this_program(self):
        gc.collect()
        answer = b'{"jsonrpc": "2.0", "id": 1, "error": {"code": -32011, "message": "full", "data": {"name": "busy"}}}\n'
        with Impostor(lambda request: answer) as service, slsd.Scanner(service.path) as scanner:
            with self.assertRaisesRegex(slsd.Busy, "^full$"):
                scanner.scan(shared=False)


class Inspections(OnAService):
    def test_of_the_service_come_whole(self):
        self.assertIn("# EOF", self.scanner.metrics())
        self.assertTrue(self.scanner.bundle().startswith(b"bundle.json\0"))


def methods():
    return {name: member for name, member in vars(slsd.Scanner).items() if inspect.isfunction(member) and name[0] != "_"}


class Types(unittest.TestCase):
    def test_leave_no_option_untyped_or_undocumented(self):
        self.assertGreater(len(methods()), 15)
        for name, method in methods().items():
            about = inspect.getdoc(method) or ""
            self.assertTrue(about, name)
            for parameter in list(inspect.signature(method).parameters.values())[1:]:
                self.assertNotIn(parameter.kind, (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL), name)
                self.assertIsNot(parameter.annotation, parameter.empty, (name, parameter))
                told = about + (inspect.getdoc(slsd.Scanner) or "")
                if name == "save" and parameter.name in inspect.signature(slsd.Scanner.scan).parameters:
                    told += inspect.getdoc(slsd.Scanner.scan)
                self.assertIn(parameter.name, told, name)

    def test_of_settings_have_the_keys_of_the_configuration(self):
        text = (ROOT / "config/slsd.toml").read_text(encoding="utf-8")
        tables = dict(re.findall(r"^\[(\w+)\]\n(.*?)(?=^\[|\Z)", text, re.M | re.S))
        for table, of in (("decode", slsd.DecodeSettings), ("calibration", slsd.CalibrationSettings), ("pattern", slsd.PatternSettings),
                          ("cloud", slsd.CloudSettings)):
            part = tables[table].split("\n# [[camera]]")[0]
            keys = set(re.findall(r"^(?:# )?(\w+) = ", part, re.M))
            self.assertEqual(set(typing.get_type_hints(of)), keys)

    def test_find_a_misspelled_option(self):
        mypy = shutil.which("mypy")
        if not mypy:
            self.skipTest("mypy is not installed (apt install mypy)")
        right = ["import slsd", "s = slsd.Scanner()", 's.scan(density="pixels", normals=True, timeout_s=None)',
                 "for cloud in s.stream(rate_hz=5.0, shared=True, idle_s=1.0): print(cloud.lost, len(cloud))",
                 's.set(decode={"density": "pixels"}, camera={"left": {"exposure_us": 8000.0}})',
                 'print(s.exposure("left").exposure_us, s.calibrate(poses=8)["outcome"])', 's.scan().save("cloud.ply")']
        wrong = ['s.scan(dencity="pixels")', 's.scan(density="pixel")', "s.stream(rate=5)", 's.scan(timeout="5")',
                 's.set(decode={"dencity": "pixels"})', 's.set(camera={"left": {"exposure": 1.0}})', 's.project("grey")',
                 "s.calibrate(pose=8)", "s.scan().point", 's.exposure("left").gain']
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder, "program.py")
            program.write_text("\n".join(right + wrong) + "\n", encoding="utf-8")
            checked = subprocess.run([mypy, "--strict", "--python-executable", sys.executable, "--cache-dir", f"{folder}/cache", program, PACKAGE / "slsd"],
                                     capture_output=True, text=True, check=False, timeout=600,
                                     env={**os.environ, "MYPYPATH": str(PACKAGE)})
        lines = {int(number) for number in re.findall(r"program\.py:(\d+): error", checked.stdout)}
        self.assertEqual(lines, set(range(len(right) + 1, len(right) + len(wrong) + 1)), checked.stdout + checked.stderr)
        self.assertNotRegex(checked.stdout, r"slsd/\w+\.py:\d+: error")

    def test_are_shipped(self):
        self.assertTrue((PACKAGE / "slsd/py.typed").exists())


if __name__ == "__main__":
    unittest.main()
