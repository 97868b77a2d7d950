#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A calibration over the socket, by doubles of a camera and a projector that see somebody hold a board."""
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

from client import RpcError
from service import BIN, Service, slsctl, wait_until

CONFIGURATION = """
[[camera]]
name = "left"
driver = "file"
path = "stage"
[scan]
projector_latency_ms = 0.0
[server]
socket = "slsd.sock"
"""
BOARD = "charuco:11x7:25:18.75:DICT_5X5_1000"


def stage(state, configuration=CONFIGURATION, **options):
    return Service(configuration=configuration, program="stage-service", environment={"STATE_DIRECTORY": str(state)}, **options)


@unittest.skipUnless((BIN / "slsd-calibrate").exists(), "without slsd-calibrate")
class Calibrate(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(folder.cleanup)
        self.state = pathlib.Path(folder.name)

    def look(self, client):
        return client.call("calibrate")[0]

    def until(self, client, condition, what):
        def is_so():
            self.told = self.look(client)
            return condition(self.told)
        try:
            wait_until(is_so, what)
        except TimeoutError as error:
            raise AssertionError(f"{what}: {self.told}") from error
        return self.told

    def test_from_the_first_pose_to_the_verdict(self):
        with stage(self.state) as service:
            with service.client() as client, service.client() as other:
                self.assertFalse(self.look(client)["under_way"])
                with self.assertRaises(RpcError):
                    client.call("scan")
                begun = client.call("calibrate", action="begin", poses=8, board=BOARD)[0]
                self.assertTrue(begun["under_way"])
                states = set()

                def note(told):
                    states.add(told["progress"]["state"])
                    return not told["under_way"]
                self.until(other, lambda told: told["progress"].get("poses", 0) >= 1, "a first pose")
                for method, params in (("scan", {}), ("project", {"picture": "black"}), ("frame", {}), ("reload", {}),
                                       ("set", {"decode": {}}), ("calibrate", {"action": "begin"})):
                    with self.assertRaises(RpcError) as refused:
                        other.call(method, **params)
                    self.assertIn("calibration is under way", str(refused.exception))
                self.assertGreater(other.call("frame", as_shown=True)[0]["width_px"], 0)
                self.assertTrue(other.call("status")[0]["calibrating"])
                told = self.until(other, note, "the end")
                self.assertIsNone(told["error"], told["log"])
                self.assertIn(told["outcome"]["grade"], ("good", "usable"), told["outcome"])
                self.assertEqual(told["progress"]["state"], "in force")
                self.assertEqual(told["progress"]["poses"], 8)
                camera = told["progress"]["cameras"][0]
                self.assertEqual((camera["name"], camera["width_px"]), ("left", 960))
                self.assertGreater(sum(count > 0 for count in camera["coverage"]["counts"]), 20)
                self.assertTrue(states & {"moving", "still", "hold", "taken", "done"}, states)
                kept = self.state / "calibration-slsd.yml"
                self.assertEqual(client.call("status")[0]["calibration"], str(kept))
                self.assertTrue(kept.with_suffix(".html").exists())
                self.assertEqual(client.call("settings")[0]["set"], {"calibration": {"file": str(kept)}})
                self.assertGreater(client.call("scan", timeout_ms=20000)[0]["points"], 500)
            self.assertEqual(service.stop()[0], 0)

    def test_a_camera_for_colour_alone_is_calibrated_with_the_others(self):
        configuration = '[[camera]]\nname = "colour"\ndriver = "file"\npath = "stage"\nuse = "texture"\n' + CONFIGURATION
        with stage(self.state, configuration) as service, service.client() as client:
            done = slsctl("--socket", service.socket, "calibrate", "--poses", 4, "--board", BOARD)
            self.assertEqual(done.returncode, 0, done.stderr)
            # It stands first in the file, and last in the calibration: the other gives the frame.
            self.assertRegex(done.stdout, r"(?m)^camera left +camera colour +projector$")
            kept = (self.state / "calibration-slsd.yml").read_text(encoding="utf-8")
            self.assertEqual(re.findall(r'name: "(.*)"', kept), ["left", "colour"])
            status = client.call("status")[0]
            self.assertEqual(status["calibration"], str(self.state / "calibration-slsd.yml"))
            self.assertEqual([camera.get("use") for camera in client.call("settings")[0]["cameras"]], [None, "texture"])
            self.assertGreater(client.call("scan", timeout_ms=20000)[0]["points"], 500)

    def test_by_slsctl(self):
        with stage(self.state) as service:
            self.assertIn("no calibration", slsctl("--socket", service.socket, "calibrate", "look").stdout)
            done = slsctl("--socket", service.socket, "calibrate", "--poses", 8, "--board", BOARD)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, r"(?s)pictures in .*verdict: (good|usable).*in force: (good|usable)\n$")
            lines = [line for line in done.stdout.splitlines() if line.startswith("verdict")]
            self.assertEqual(len(lines), 1, done.stdout)
            self.assertEqual(slsctl("--socket", service.socket, "calibrate", "look").stdout, "in force, 8 of 8 poses\n")
            failed = slsctl("--socket", service.socket, "calibrate", "--board", "no board at all")
            self.assertEqual(failed.returncode, 1)
            self.assertIn("board", failed.stderr)
            self.assertEqual(slsctl("--socket", service.socket, "calibrate", "--poses", 2).returncode, 2)
            with subprocess.Popen([BIN / "slsctl", "--socket", service.socket, "calibrate", "--board", BOARD],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
                self.assertIn("pictures in", running.stdout.readline())
                running.send_signal(signal.SIGINT)  # ends it with the poses that are there
                out, said = running.communicate(timeout=600)
                self.assertEqual(running.returncode, 1, out)
                self.assertIn("at least 3 are needed", said)

    def test_one_that_is_ended_too_early_cancelled_or_killed_changes_nothing(self):
        with stage(self.state) as service, service.client() as client:
            client.call("calibrate", action="begin", board=BOARD)
            self.until(client, lambda told: "poses" in told["progress"], "a look")
            client.call("calibrate", action="end")
            told = self.until(client, lambda told: not told["under_way"], "an end")
            self.assertIn("at least 3 are needed", told["error"])
            client.call("calibrate", action="begin", board=BOARD)
            client.call("calibrate", action="cancel")
            self.assertIn("cancelled", self.until(client, lambda told: not told["under_way"], "an end")["error"])
            client.call("calibrate", action="begin", board=BOARD)
            children = pathlib.Path(f"/proc/{service.process.pid}/task/{service.process.pid}/children").read_text().split()
            self.assertEqual(len(children), 1)
            os.kill(int(children[0]), signal.SIGKILL)
            self.assertIn("ended early", self.until(client, lambda told: not told["under_way"], "an end")["error"])
            client.call("calibrate", action="begin", board="no board at all")
            told = self.until(client, lambda told: not told["under_way"], "an end")
            self.assertIn("board", told["error"])
            client.call("calibrate", action="begin", board=BOARD)
            begin = time.monotonic()
            self.assertEqual(service.stop()[0], 0)  # while one is under way
            self.assertLess(time.monotonic() - begin, 60)
            self.assertEqual([each.name for each in self.state.glob("*.yml")], [])

    def test_wrong_parameters_begin_nothing(self):
        with stage(self.state) as service, service.client() as client:
            for params in ({"poses": 2}, {"poses": 100}, {"board": 3}, {"action": "stop"}, {"code": "morse"}):
                with self.assertRaises(RpcError):
                    client.call("calibrate", **{"action": "begin", **params})
            self.assertFalse(self.look(client)["under_way"])

    def test_without_a_place_to_keep_it_none_begins(self):
        with Service(configuration=CONFIGURATION, program="stage-service") as service, service.client() as client:
            with self.assertRaises(RpcError) as refused:
                client.call("calibrate", action="begin")
            self.assertIn("STATE_DIRECTORY", str(refused.exception))


if __name__ == "__main__":
    unittest.main(verbosity=2)
