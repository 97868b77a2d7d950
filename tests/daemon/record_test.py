#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsctl record, and the replay of what it wrote."""
import array
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import robot_frame_test as robot_frame
from service import BIN, TIMEOUT_S, SCENE, Service, slsctl, wait_until

CORPUS = pathlib.Path(__file__).parent.parent / "corpus"
# Of a cloud's file these lines name the scan; every other byte is the measurement's.
NAMES_OF_A_SCAN = (b"comment scan_id ", b"comment time ", b"comment frame ")
LEFT = "../left eye"
TWO_CAMERAS = """
[pattern]
file = "{corpus}/pattern.toml"
[[camera]]
name = "../left eye"
path = "left"
[[camera]]
name = "right"
path = "right.pgm"
[calibration]
file = "two.yml"
[decode]
depth_min_mm = 1500.0
classify = "default"
[scan]
timeout_ms = 600000
exposure_skew_ms = 10000
[server]
socket = "slsd.sock"
"""
SAME_PLACE = """
      rig_from_camera_R: !!opencv-matrix
         rows: 3
         cols: 3
         dt: d
         data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
      rig_from_camera_T: !!opencv-matrix
         rows: 3
         cols: 1
         dt: d
         data: [ 0., 0., 0. ]
"""


def calibration_of_two():
    """The corpus' camera twice at the same place, under two names."""
    text = (CORPUS / "16px-5-bust" / "calibration.yml").read_text(encoding="utf-8")
    head, camera = text.split("   -\n")
    first, second = (camera.rstrip().replace('name: "camera"', f'name: "{name}"') for name in (LEFT, "right"))
    assert first != second
    return f"{head}   -\n{first}\n   -\n{second}{SAME_PLACE}"


def write_16_bits(file, pixels, width, height):
    """The same picture in 16 bits, with something in the lower ones."""
    values = array.array("H", (257 * value ^ (i & 1) for i, value in enumerate(pixels)))
    if sys.byteorder == "little":
        values.byteswap()
    file.write_bytes(f"P5 {width} {height} 65535\n".encode() + values.tobytes())


def measured(ply):
    """A cloud's file without the lines that name its scan."""
    header, body = ply.split(b"end_header\n", 1)
    return [line for line in header.split(b"\n") if not line.startswith(NAMES_OF_A_SCAN)], body


def lines_of(recording):
    return [json.loads(line) for line in (recording / "scans.jsonl").read_text(encoding="utf-8").splitlines()]


def two_cameras(pixels, width, height):
    """A service of two cameras, of 8 and of 16 bits; the first sees two scenes in turn."""
    service = Service(configuration=TWO_CAMERAS.format(corpus=CORPUS / "16px-5-bust"))
    (service.folder / "left").mkdir()
    for i, scene in enumerate(("16px-5-bust", "16px-5-plane_0")):
        shutil.copy(CORPUS / scene / "frame.png", service.folder / "left" / f"{i}.png")
    (service.folder / "two.yml").write_text(calibration_of_two(), encoding="utf-8")
    write_16_bits(service.folder / "right.pgm", pixels, width, height)
    return service


class Record(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.one = Service(camera_path=CORPUS / "16px-5-bust" / "frame.png").start()
        cls.one.wait_ready()
        with cls.one.client() as client:
            told, pixels = client.call("frame", format="raw")
        cls.two = two_cameras(pixels, told["width_px"], told["height_px"]).start()
        cls.two.wait_ready()

    @classmethod
    def tearDownClass(cls):
        for service in (cls.one, cls.two):
            service.__exit__()

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        self.recording = self.folder / "recording"

    def record(self, service, *arguments):
        return slsctl("--socket", service.socket, "record", self.recording, *arguments)

    def start_recording(self, service, *arguments):
        """slsctl at work, once its first frame is there."""
        process = subprocess.Popen([BIN / "slsctl", "--socket", service.socket, *arguments, "record", self.recording],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        wait_until(lambda: (self.recording / "camera" / "00000000.png").exists(), "a frame")
        return process

    def replay(self):
        """A service on the recording itself."""
        service = Service(configuration=(self.recording / "slsd.toml").read_text(encoding="utf-8"))
        shutil.copytree(self.recording, service.folder, dirs_exist_ok=True)
        return service

    def test_replay_gives_the_same_clouds_byte_for_byte(self):
        result = self.record(self.two, "--frames", "2", "--clouds")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("2 scans, 0 failed", result.stdout)
        with self.replay() as service, service.client() as client:
            told = [client.call("scan", timeout_ms=600000, frames="raw") for _ in range(2)]
            frames = [payload for event, payload in client.events if event["params"]["camera"] == "right"]
        for line, (result, cloud) in zip(lines_of(self.recording), told):
            recorded = (self.recording / line["cloud"]).read_bytes()
            self.assertGreater(result["points"], 1000)
            self.assertEqual(measured(recorded), measured(cloud))
        self.assertEqual(len(frames[0]), 2 * 1600 * 1200)
        self.assertNotEqual(measured(told[0][1]), measured(told[1][1]))

    def test_replay_shows_the_same_part(self):
        """A box in the robot's base and cubes, of a scanner in a robot's cell."""
        service = Service()
        at = (robot_frame.MOUNT[:3, :3] @ [0, 0, 2000] + robot_frame.MOUNT[:3, 3]).tolist()
        (service.folder / "hand_eye.yml").write_text(robot_frame.hand_eye("cell"), encoding="utf-8")
        with open(service.file, "a", encoding="utf-8") as file:
            file.write('[frame]\noutput = "robot_base"\nhand_eye = "hand_eye.yml"\n[cloud]\nbox_frame = "robot_base"\nvoxel_mm = 15.5\n'
                       f"box = {[each - 170 for each in at] + [each + 170 for each in at]}\n")
        with service:
            service.wait_ready()
            self.assertEqual(self.record(service, "--frames", "1", "--clouds").returncode, 0)
        line, = lines_of(self.recording)
        self.assertTrue(50 < line["points"] < 1000, line["points"])
        self.assertNotIn("hand_eye_file", (self.recording / "recording.json").read_text(encoding="utf-8"))
        with self.replay() as service, service.client() as client:
            cloud = client.call("scan", timeout_ms=600000)[1]
        self.assertEqual(measured((self.recording / line["cloud"]).read_bytes()), measured(cloud))

    def test_replay_shows_what_was_asked_for(self):
        """Pixels within a box, which the service would not measure by itself."""
        service = self.enterContext(Service())
        service.wait_ready()
        before = slsctl("--socket", service.socket, "settings").stdout
        result = self.record(service, "--frames", "1", "--clouds", "--density", "pixels", "--normals", "--stride", "2",
                             "--voxel-mm", "1.5", "--box", "-100,-100,1500,100,100,2500", "--box-frame", "rig")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(slsctl("--socket", service.socket, "settings").stdout, before)
        line, = lines_of(self.recording)
        self.assertEqual(line["density"], "pixels")
        self.assertGreater(line["points"], 1000)
        about = json.loads((self.recording / "recording.json").read_text(encoding="utf-8"))["configuration"]
        self.assertEqual(about["decode"]["density"], "pixels")
        self.assertEqual(about["cloud"], {"box": [-100, -100, 1500, 100, 100, 2500], "box_frame": "rig", "stride": 2, "voxel_mm": 1.5})
        with self.replay() as service, service.client() as client:
            told, cloud = client.call("scan", timeout_ms=600000, normals=True)
        self.assertEqual((told["density"], told["points"]), ("pixels", line["points"]))
        recorded = (self.recording / line["cloud"]).read_bytes()
        self.assertIn(b"property float nx\n", recorded)
        self.assertEqual(measured(recorded), measured(cloud))

    def test_a_preset_is_in_force_from_the_first_scan(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as state, Service(environment={"STATE_DIRECTORY": state}) as service:
            service.wait_ready()
            with service.client() as client:
                client.call("set", decode={"depth_max_mm": 600.0})
                client.call("preset", action="save", name="near")
                client.call("set", decode={"depth_max_mm": None})
            result = self.record(service, "--frames", "2", "--preset", "far")
            self.assertEqual(result.returncode, 1)
            self.assertIn("far", result.stderr)
            self.assertFalse(self.recording.exists())
            result = self.record(service, "--frames", "2", "--preset", "near")
            self.assertEqual(result.returncode, 0, result.stderr)
            with service.client() as client:
                self.assertEqual(client.call("status")[0]["scans"]["succeeded"], 2)
        self.assertEqual([line["points"] for line in lines_of(self.recording)], [0, 0])
        with self.replay() as service, service.client() as client:
            self.assertEqual(client.call("settings")[0]["configuration"]["decode"], {"depth_max_mm": 600.0})

    def test_holds_everything_that_a_cloud_depends_on(self):
        self.assertEqual(self.record(self.two, "--frames", "1").returncode, 0)
        written = {str(file.relative_to(self.recording)) for file in self.recording.rglob("*") if file.is_file()}
        self.assertEqual(written, {"slsd.toml", "pattern.toml", "calibration.yml", "recording.json", "scans.jsonl",
                                   "___left_eye/00000000.png", "right/00000000.png"})
        about = json.loads((self.recording / "recording.json").read_text(encoding="utf-8"))
        self.assertEqual((about["scans"], about["failed"]), (1, 0))
        self.assertEqual(about["configuration"]["decode"], {"depth_min_mm": 1500.0, "classify": "default"})
        self.assertEqual([camera["folder"] for camera in about["cameras"]], ["___left_eye", "right"])
        line, = lines_of(self.recording)
        self.assertEqual([frame["bits"] for frame in line["frames"]], [8, 16])
        for frame in line["frames"]:
            self.assertGreaterEqual(frame["received_ns"], frame["exposure_start_ns"])

    def test_full_disk_ends_it_in_step(self):
        """A limit on a file's size stands for the full disk: the first camera's frame fits, the second's does not."""
        with self.two.client() as client:
            client.call("scan", timeout_ms=600000, frames="png")
            first, second = (len(payload) for _, payload in client.events)
        self.assertLess(first + 4096, second)
        script = f"trap '' XFSZ; ulimit -f {(first + second) // 2048}; exec \"$@\""
        result = subprocess.run(["bash", "-c", script, "bash", BIN / "slsctl", "--socket", self.two.socket, "record",
                                 self.recording], capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
        self.assertEqual(result.returncode, 1)
        self.assertIn("free some space", result.stderr)
        for folder in ("___left_eye", "right"):
            self.assertEqual(list((self.recording / folder).iterdir()), [])

    def test_ends_at_an_interrupt_with_whole_files(self):
        process = self.start_recording(self.one, "--json")
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 0, error)
        summary = json.loads(out)
        self.assertEqual(summary["scans"], len(list((self.recording / "camera").iterdir())))
        self.assertEqual(summary["scans"], len(lines_of(self.recording)))

    def test_ends_when_the_time_is_over(self):
        result = self.record(self.one, "--seconds", "0.2")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreater(len(lines_of(self.recording)), 0)

    def test_passes_over_lost_frames_and_ends_with_the_replay(self):
        frames = self.folder / "frames"
        frames.mkdir()
        for i in range(3):
            shutil.copy(SCENE / "black.png", frames / f"{i}.png")
        with Service(camera_path=frames, camera='loop = false\nfaults = ["drop@2"]') as service:
            result = self.record(service)
        self.assertEqual(result.returncode, 1)
        self.assertIn("images have been replayed", result.stderr)
        lines = lines_of(self.recording)
        self.assertEqual([line.get("error") for line in lines], [None, None])
        self.assertEqual([line["tries"] for line in lines], [1, 2])
        self.assertEqual(lines[1]["lost_tries"][0]["data"]["name"], "frame_dropped")
        self.assertEqual(len(list((self.recording / "camera").iterdir())), len(lines))
        about = json.loads((self.recording / "recording.json").read_text(encoding="utf-8"))
        self.assertEqual((about["scans"], about["failed"]), (len(lines), 0))

    def test_says_when_the_service_was_reloaded_and_when_it_ended(self):
        with Service() as service:
            process = self.start_recording(service)
            with open(service.file, "a", encoding="utf-8") as file:
                file.write("[decode]\ndepth_max_mm = 2400.0\n")
            with service.client() as client:
                client.call("reload")
            process.send_signal(signal.SIGINT)
            _, error = process.communicate(timeout=TIMEOUT_S)
            self.assertEqual(process.returncode, 1)
            self.assertIn("was reloaded while recording", error)
            shutil.rmtree(self.recording)
            process = self.start_recording(service)
            service.stop()
            _, error = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 1)
        self.assertRegex(error, "closed the connection|stopping")

    def test_refuses_a_folder_with_something_in_it(self):
        self.recording.mkdir()
        (self.recording / "mine").touch()
        result = self.record(self.one)
        self.assertEqual(result.returncode, 1)
        self.assertIn("is not an empty folder", result.stderr)
        self.assertEqual(list(self.recording.iterdir()), [self.recording / "mine"])
        result = slsctl("--socket", self.one.socket, "record", self.recording / "mine" / "below", "--frames", "1")
        self.assertEqual(result.returncode, 1)
        self.assertIn("below", result.stderr)

    @unittest.skipIf(os.geteuid() == 0, "everything is permitted to root")
    def test_says_what_is_not_permitted(self):
        self.folder.chmod(0o500)
        result = self.record(self.one)
        self.folder.chmod(0o700)
        self.assertEqual(result.returncode, 1)
        self.assertIn("Permission denied", result.stderr)

    def test_usage(self):
        for usage in (["record"], ["record", "x", "--frames", "0"], ["record", "x", "--seconds", "-1"], ["record", "-"],
                      ["record", "x", "--density", "lines"], ["record", "x", "--box", "1,2,3"], ["record", "x", "--stride", "0"],
                      ["record", "x", "--normals"], ["record", "x", "--clouds", "--normals", "--density", "symbols"]):
            self.assertEqual(slsctl(*usage).returncode, 2)
        self.assertEqual(slsctl("--socket", self.folder / "none", "record", self.recording).returncode, 3)
        self.assertFalse(self.recording.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
