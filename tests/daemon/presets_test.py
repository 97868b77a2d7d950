#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Presets: saved by name, in force within one scan, kept beside the settings; what cannot be used changes nothing."""
import json
import os
import pathlib
import tempfile
import threading
import unittest

from client import RpcError
from service import SCENE, Service, slsctl


def processor_s(process):
    """Processor time of a process so far."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Presets(unittest.TestCase):
    def setUp(self):
        self.state = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="slsd-test-")))
        self.file = self.state / "presets-slsd.json"
        self.service = self.enterContext(Service(environment={"STATE_DIRECTORY": str(self.state)}))
        self.client = self.enterContext(self.service.client())

    def call(self, method, **params):
        return self.client.call(method, **params)[0]

    def refused(self, method, **params):
        with self.assertRaises(RpcError) as refused:
            self.client.call(method, **params)
        return refused.exception.name, str(refused.exception)

    def save_two(self):
        """near sees nothing of the wall at 2 m; far sees all of it."""
        self.call("set", decode={"depth_max_mm": 600.0})
        self.call("preset", action="save", name="near")
        self.call("set", decode={"depth_max_mm": None, "wrong_cells_max": 0.5})
        self.call("preset", action="save", name="far")

    def test_are_in_force_with_the_scan_that_names_them(self):
        self.save_two()
        for name, seen in (("near", False), ("far", True), ("far", True), ("near", False)):
            result = self.call("scan", preset=name)
            self.assertEqual((result["points"] > 2000, result["preset"]), (seen, name))
            self.assertEqual(self.call("presets")["in_force"], name)
            self.assertEqual(self.call("scan")["points"] > 2000, seen)  # it stays in force
        self.assertEqual(self.call("settings")["set"], {"decode": {"depth_max_mm": 600.0}})

    def test_cost_one_scan_no_second_one(self):
        """A scan that changes the preset makes the decoder anew, and no second scan. Processor time, as others may use the machine."""
        self.save_two()
        self.call("scan", preset="near")
        begin = processor_s(self.service.process)
        for name in ("far", "near") * 3:
            before = self.call("status")["scans"]["succeeded"]
            self.call("scan", preset=name)
            self.assertEqual(self.call("status")["scans"]["succeeded"], before + 1)
        self.assertLess((processor_s(self.service.process) - begin) / 6, 5)

    def test_survive_a_restart(self):
        self.save_two()
        self.service.stop()
        with self.service, self.service.client() as client:
            self.assertEqual(set(client.call("presets")[0]["presets"]), {"near", "far"})
            self.assertEqual(client.call("scan", preset="near")[0]["points"], 0)

    def test_leave_the_calibration_alone(self):
        self.call("set", calibration={"file": str(SCENE / "calibration.yml")}, decode={"density": "pixels"})
        self.call("preset", action="save", name="a")
        self.assertNotIn("calibration", json.loads(self.file.read_text(encoding="utf-8"))["a"]["settings"])
        self.call("set", decode={"density": None})
        self.call("preset", action="use", name="a")
        self.assertEqual(self.call("settings")["set"], {"decode": {"density": "pixels"}, "calibration": {"file": str(SCENE / "calibration.yml")}})

    def test_give_the_density_that_they_name(self):
        self.call("set", decode={"density": "pixels", "dense_stride_px": 16})
        self.call("preset", action="save", name="pixels")
        self.call("set", decode={"density": None, "dense_stride_px": None})
        result = self.call("scan", preset="pixels", normals=True, timeout_ms=600000)
        self.assertEqual(result["density"], "pixels")

    def test_that_cannot_be_used_change_nothing(self):
        self.save_two()
        presets = json.loads(self.file.read_text(encoding="utf-8"))
        presets["later"] = {**presets["near"], "version": 2}
        presets["unknown-key"] = {**presets["near"], "settings": {"decode": {"depth_max": 600.0}}}
        presets["no-camera"] = {**presets["near"], "settings": {"camera": {"gone": {"gain_db": 1.0}}}}
        self.file.write_text(json.dumps(presets), encoding="utf-8")
        before = self.call("settings")["set"]
        for name, error, words in (("nera", "not_found", "did you mean near?"), ("later", "mismatch", "has version 2, and this slsd reads version 1"),
                                   ("unknown-key", "invalid_argument", "depth_max"), ("no-camera", "not_found", "gone"),
                                   ("x\n\x1b", "not_found", "x\\n")):
            for method, params in (("scan", {"preset": name}), ("preset", {"action": "use", "name": name})):
                got, message = self.refused(method, **params)
                self.assertEqual(got, error, message)
                self.assertIn(words, message)
                self.assertNotIn("\n", message)
            self.assertEqual(self.call("settings")["set"], before)
        self.assertEqual(self.refused("scan", preset="near", format="stl")[0], "invalid_params")
        self.assertEqual(self.call("settings")["set"], before)
        self.assertGreater(self.call("scan")["points"], 2000)
        self.call("preset", action="delete", name="later")
        self.assertNotIn("later", self.call("presets")["presets"])
        self.assertEqual(self.refused("preset", action="delete", name="later")[0], "not_found")
        self.assertEqual(self.refused("preset", action="save", name="a/b")[0], "invalid_argument")

    def test_of_a_broken_file_are_named_and_scans_go_on(self):
        for text in ("{", "[]", "x" * 1000):
            self.file.write_text(text, encoding="utf-8")
            for method, params in (("presets", {}), ("scan", {"preset": "a"}), ("preset", {"action": "save", "name": "a"})):
                name, message = self.refused(method, **params)
                self.assertEqual(name, "malformed")
                self.assertIn("presets-slsd.json", message)
            self.assertGreater(self.call("scan")["points"], 2000)
            self.assertEqual(self.file.read_text(encoding="utf-8"), text)

    def test_of_two_clients_never_mix(self):
        self.save_two()
        wrong, busy = [], []

        def scan(name, seen):
            with self.service.client() as client:
                for _ in range(15):
                    try:
                        if (client.call("scan", preset=name, timeout_ms=600000)[0]["points"] > 2000) != seen:
                            wrong.append(name)
                    except RpcError as error:
                        busy.append(error.name)

        threads = [threading.Thread(target=scan, args=args) for args in (("near", False), ("far", True), ("far", True))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])
        self.assertLess(len(busy), 45)
        self.assertTrue(set(busy) <= {"busy"})
        self.call("preset", action="use", name="near")  # nothing holds the settings any more
        self.call("preset", action="use", name="far")

    def slsctl(self, *words):
        done = slsctl("--socket", self.service.socket, *words)
        return done.returncode, done.stdout, done.stderr

    def test_on_the_command_line(self):
        for words in (("set", "decode.depth_max_mm=600"), ("preset", "save", "near"), ("set", "decode.depth_max_mm=default"), ("preset", "save", "far")):
            self.assertEqual(self.slsctl(*words), (0, "", ""))
        self.assertEqual(self.slsctl("preset", "list"), (0, "far  (in force)\nnear\n", ""))
        self.assertEqual(self.slsctl("preset", "show", "near"), (0, "decode.depth_max_mm=600\n", ""))
        self.assertEqual(self.slsctl("preset", "use", "near"), (0, "", ""))
        self.assertEqual(self.slsctl("preset", "list")[1], "far\nnear  (in force)\n")
        status, out, _ = self.slsctl("scan", "--preset", "far")
        self.assertEqual(status, 0)
        self.assertRegex(out, r"\d{4} points")
        status, out, error = self.slsctl("scan", "--preset", "fra", self.state / "cloud.ply")
        self.assertEqual((status, out, error.count("\n")), (1, "", 1))
        self.assertIn('there is no preset "fra"; did you mean far?', error)
        self.assertFalse((self.state / "cloud.ply").exists())
        self.assertEqual(self.slsctl("preset", "delete", "far"), (0, "", ""))
        self.assertEqual(json.loads(self.slsctl("--json", "preset", "show", "near")[1])["version"], 1)
        self.assertEqual(list(json.loads(self.slsctl("--json", "preset", "list")[1])["presets"]), ["near"])
        for words in (("preset",), ("preset", "save"), ("preset", "list", "a"), ("preset", "keep", "a")):
            self.assertEqual(self.slsctl(*words)[0], 2, words)


class WithoutAState(unittest.TestCase):
    def test_are_refused_in_one_sentence(self):
        with Service(environment={"STATE_DIRECTORY": ""}) as service, service.client() as client:
            self.assertEqual(client.call("presets")[0], {"presets": {}, "in_force": None})
            with self.assertRaisesRegex(RpcError, "STATE_DIRECTORY is not set"):
                client.call("preset", action="save", name="a")


if __name__ == "__main__":
    unittest.main(verbosity=2)
