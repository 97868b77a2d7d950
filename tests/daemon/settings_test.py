#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Settings without a restart: set over the socket, kept beside the configuration, refused by a camera."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from client import RpcError
from gige_double import Double, service_on
from recovery import scan_until_it_works
from service import BIN, SCENE, Service, slsctl

COARSE = "\n[decode]\ndense_stride_px = 8\n"  # --check measures dense clouds too, which are none of these tests' business


def configured(client):
    return client.call("settings")[0]


class Decoding(unittest.TestCase):
    def setUp(self):
        state = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(state.cleanup)
        self.state = pathlib.Path(state.name)
        self.environment = {"STATE_DIRECTORY": str(self.state)}

    def test_is_in_force_at_once_and_after_a_restart(self):
        service = Service(environment=self.environment)
        with service, service.client() as client:
            before = service.file.read_text(encoding="utf-8")
            self.assertGreater(client.call("scan")[0]["points"], 2000)
            self.assertEqual(configured(client)["set"], {})
            reply = client.call("set", decode={"depth_max_mm": 600.0, "density": "pixels"})[0]
            self.assertEqual(reply["set"], {"decode": {"depth_max_mm": 600.0, "density": "pixels"}})
            self.assertIsNone(reply["not_kept"])
            scan = client.call("scan", density="symbols")[0]
            self.assertEqual(scan["points"], 0)  # the plane is at 2 m
            self.assertEqual(client.call("scan", timeout_ms=600000)[0]["density"], "pixels")
            self.assertEqual(configured(client)["set"], reply["set"])
            self.assertEqual(configured(client)["configuration"]["decode"]["density"], "pixels")
            client.call("reload")
            self.assertEqual(client.call("scan", density="symbols")[0]["points"], 0)
            self.assertEqual(service.file.read_text(encoding="utf-8"), before)
            self.assertEqual(service.stop()[0], 0)
        with service, service.client() as client:
            self.assertEqual(client.call("scan", density="symbols")[0]["points"], 0)
            client.call("set", decode={"depth_max_mm": None, "density": None})
            self.assertGreater(client.call("scan")[0]["points"], 2000)
            self.assertEqual(configured(client)["set"], {})
        self.assertEqual(json.loads((self.state / "settings-slsd.json").read_text(encoding="utf-8")), {})

    def test_takes_a_whole_number_however_it_is_written(self):
        with Service(environment=self.environment) as service, service.client() as client:
            for decode in ({"dense_stride_px": 8.0, "depth_max_mm": 2400}, {"dense_stride_px": 8, "depth_max_mm": 2400.0}):
                client.call("set", decode=decode)
                self.assertEqual(configured(client)["configuration"]["decode"], decode)
            for stride in (8.5, 1e300):
                with self.assertRaisesRegex(RpcError, "dense_stride_px"):
                    client.call("set", decode={"dense_stride_px": stride})
            self.assertGreater(client.call("scan", timeout_ms=600000.0)[0]["points"], 2000)
            client.call("set", pattern={"symbol_size_px": 16.0, "symbols": [11.0, 13, 14, 18, 19]})
            self.assertEqual(configured(client)["configuration"]["pattern"]["symbol_size_px"], 16)

    def test_check_and_verify_take_what_was_set(self):
        other = self.state / "other.yml"
        shutil.copy(SCENE / "calibration.yml", other)
        own = {**os.environ, **self.environment}

        def slsd(*arguments):
            done = subprocess.run([BIN / "slsd", *map(str, arguments), "--config", service.file], capture_output=True, text=True,
                                  check=False, env=own)
            return done.stdout + done.stderr
        service = Service(environment=self.environment, camera=COARSE)
        with service:
            with service.client() as client:
                client.call("set", calibration={"file": str(other)}, decode={"depth_max_mm": 2000.0})
            said = slsd("--check")
            self.assertIn("set over the socket: calibration.file, decode.depth_max_mm", said)
            self.assertNotIn("differs from this file", said)
            self.assertEqual(service.stop()[0], 0)
        self.assertIn("set over the socket: calibration.file, decode.depth_max_mm", slsd("--check"))
        if (BIN / "slsd-calibrate").exists():
            self.assertIn("set over the socket: calibration.file", slsd("--verify", "--from", self.state))
        (self.state / "settings-slsd.json").write_text("{", encoding="utf-8")
        self.assertIn("ignoring the settings made over the socket", slsd("--check"))

    def test_what_cannot_be_set_changes_nothing(self):
        with Service(environment=self.environment) as service, service.client() as client:
            for params, words in (({"decode": {"depth_max": 1}}, "depth_max"),
                                  ({"decode": {"depth_max_mm": -5.0}}, "depth_max_mm"),
                                  ({"decode": {"density": "all"}}, "density"),
                                  ({"decode": {"density": [1]}}, "density"),
                                  ({"decode": 1}, "decode"),
                                  ({"server": {"socket": "/tmp/x"}}, "server"),
                                  ({"camera": {"nobody": {"gain_db": 1.0}}}, "nobody"),
                                  ({"camera": {"camera": {"path": "/etc"}}}, "path"),
                                  ({"camera": {"camera": {"gain_db": 1.0}}}, "gain_db"),  # a replay has none
                                  ({"camera": {"camera": 3}}, "camera"),
                                  ({"calibration": {"file": "/nowhere/calibration.yml"}}, "/nowhere"),
                                  ({"calibration": {"file": str(SCENE / "pattern.toml")}}, "is not YAML"),
                                  ({"calibration": {"file": "/dev/zero"}}, "regular file"),
                                  ({"pattern": {"symbol_size_px": 9}}, "symbol_size_px"),
                                  ({"pattern": {"symbols": [[1]]}}, "symbols"),
                                  ({"pattern": {"symbols": [5] * 100}}, "symbols"),
                                  ({"decode": {"x\n\x1b": 1}}, "x\\n")):
                with self.assertRaises(RpcError) as refused:
                    client.call("set", **params)
                self.assertIn(words, str(refused.exception))
            self.assertEqual(configured(client)["set"], {})
            self.assertGreater(client.call("scan")[0]["points"], 2000)
        self.assertEqual(list(self.state.iterdir()), [])

    def test_pattern_and_calibration_are_taken_too(self):
        other = self.state / "calibration.yml"
        shutil.copy(SCENE / "calibration.yml", other)
        with Service(environment=self.environment) as service:
            with service.client() as client:
                before = client.call("settings")[0]
                client.call("set", pattern={"symbol_size_px": 12, "seed": 3}, calibration={"file": str(other)})
                after = client.call("settings")[0]
                self.assertNotEqual(after["pattern"], before["pattern"])
                self.assertIn("symbol_size_px = 12", after["pattern"])
                self.assertEqual(after["configuration"]["pattern"], {"symbol_size_px": 12, "seed": 3})
                self.assertEqual(client.call("status")[0]["calibration"], str(other))
                shown = slsctl("--socket", service.socket, "settings").stdout.splitlines()
                self.assertIn("pattern.seed = 3  (set)", shown)
                self.assertIn('camera.camera.driver = "file"  (slsd.toml)', shown)
                client.call("set", pattern={"symbol_size_px": None, "seed": None})
                self.assertEqual(client.call("settings")[0]["pattern"], before["pattern"])
                self.assertGreater(client.call("scan")[0]["points"], 2000)
            service.stop()
            other.unlink()  # what is kept names a file that is gone
            service.start()
            with service.client() as client:
                self.assertEqual(client.call("status")[0]["calibration"], str(SCENE / "calibration.yml"))
                self.assertIn("ignoring the settings made over the socket", service.log_text())

    def test_a_kept_file_that_is_broken_holds_up_no_start(self):
        for text in ("{", "[]", '{"decode": {"no_such_key": 1}}', '{"camera": {"gone": {"gain_db": 1}}}', "x" * 100_000):
            (self.state / "settings-slsd.json").write_text(text, encoding="utf-8")
            with Service(environment=self.environment) as service, service.client() as client:
                self.assertEqual(configured(client)["set"], {}, text[:20])
                self.assertIn("ignoring the settings made over the socket", service.log_text())

    def test_without_a_place_to_keep_them_they_are_in_force(self):
        with Service() as service, service.client() as client:
            reply = client.call("set", decode={"density": "pixels"})[0]
            self.assertIn("STATE_DIRECTORY", reply["not_kept"])
            shown = slsctl("--socket", service.socket, "set", "decode.density=symbols", "decode.depth_max_mm=2400.5")
            self.assertEqual(shown.returncode, 0)
            self.assertIn("not saved", shown.stderr)
            self.assertEqual(configured(client)["set"], {"decode": {"density": "symbols", "depth_max_mm": 2400.5}})
            slsctl("--socket", service.socket, "set", "decode.density=default", "decode.depth_max_mm=default")
            self.assertEqual(configured(client)["set"], {})
            self.assertEqual(slsctl("--socket", service.socket, "set", "density").returncode, 2)
            wrong = slsctl("--socket", service.socket, "set", "decode.density=none")
            self.assertEqual((wrong.returncode, "density" in wrong.stderr), (1, True))


class Exposure(unittest.TestCase):
    def setUp(self):
        self.double = Double()
        self.addCleanup(self.double.close)

    def test_a_camera_takes_it_or_stays_as_it_was(self):
        with service_on(self.double, "exposure_us = 4000.0") as service, service.client() as client:
            scan_until_it_works(client)
            self.assertEqual(configured(client)["cameras"][0]["exposure_us"], 4000)
            self.assertEqual(client.call("set", camera={"camera": {"exposure_us": 9000.0, "gain_db": 3.0}})[0]["needs_restart"],
                             [])
            self.assertEqual(configured(client)["cameras"][0]["exposure_us"], 9000)
            self.assertEqual(configured(client)["cameras"][0]["gain_db"], 3)
            self.assertEqual(configured(client)["configuration"]["camera"][0]["exposure_us"], 9000)
            self.assertGreater(scan_until_it_works(client)[2]["points"], 2000)
            for key, value, reason in (("gain_db", 59.0, "0 to 24, not 59"),  # beyond what the device has
                                       ("exposure_us", 9e6, "10 to 1000000, not 9000000")):
                with self.assertRaises(RpcError) as refused:
                    client.call("set", camera={"camera": {key: value}})
                self.assertIn(reason, str(refused.exception))
                self.assertIn("camera camera", str(refused.exception))
                self.assertEqual(configured(client)["set"]["camera"]["camera"], {"exposure_us": 9000.0, "gain_db": 3.0})
                self.assertEqual(configured(client)["cameras"][0]["gain_db"], 3)
                self.assertGreater(scan_until_it_works(client)[2]["points"], 2000)
            client.call("set", camera={"camera": {"exposure_us": None, "gain_db": None}})
            self.assertEqual(configured(client)["cameras"][0]["exposure_us"], 4000)

    def test_a_reload_takes_exposures_and_tells_of_the_rest(self):
        with service_on(self.double, "exposure_us = 4000.0") as service, service.client() as client:
            scan_until_it_works(client)
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text.replace("4000.0", "5000.0"), encoding="utf-8")
            self.assertEqual(client.call("reload")[0]["needs_restart"], [])
            self.assertEqual(configured(client)["cameras"][0]["exposure_us"], 5000)
            service.file.write_text(text.replace("4000.0", "6000.0\nptp = true"), encoding="utf-8")
            self.assertEqual(client.call("reload")[0]["needs_restart"], ["camera"])
            self.assertEqual(configured(client)["cameras"][0]["exposure_us"], 6000)
            self.assertGreater(scan_until_it_works(client)[2]["points"], 2000)

    def test_a_subscriber_keeps_its_clouds(self):
        with service_on(self.double, "exposure_us = 4000.0") as service, service.client() as client, \
                service.client() as watching:
            scan_until_it_works(client)
            watching.call("subscribe", rate_hz=10)
            for exposure_us in (5000.0, 6000.0, 7000.0):
                client.call("set", camera={"camera": {"exposure_us": exposure_us}})
                while watching.receive()[0]["params"].get("points", 0) < 2000:
                    pass


if __name__ == "__main__":
    unittest.main(verbosity=2)
