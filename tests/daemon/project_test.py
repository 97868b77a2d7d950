#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What the projector shows while nobody scans, and by hand."""
import base64
import pathlib
import shutil
import tempfile
import unittest

from client import RpcError
from service import BIN, CONFIGURATION, SCENE, Service, slsctl, slsd, wait_until

IDLE = CONFIGURATION.format(scene=SCENE, camera_path=SCENE / "frame.png", camera="", server="") + """
[projector]
idle = "black"
idle_after_ms = 50
"""


def shows(client):
    return client.call("status")[0]["projector"]["shows"]


class Project(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=cls.service.folder))

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def pattern(self):
        file = self.folder / "pattern.png"
        self.assertEqual(slsd("--pattern", file, "--config", self.service.file).returncode, 0)
        return file

    def test_holds_each_picture_until_a_scan(self):
        with self.service.client() as client:
            for picture in ("pattern", "black", "white", "focus", "grid"):
                self.assertEqual(client.call("project", picture=picture)[0], {"picture": picture})
                self.assertEqual(shows(client), "held")
                client.call("frame", as_shown=True)
                self.assertEqual(shows(client), "held")
                self.assertGreater(client.call("scan")[0]["points"], 2000)
                self.assertEqual(shows(client), "pattern")
            for method in ("frame", "preview"):
                client.call("project", picture="white")
                client.call(method)
                self.assertEqual(shows(client), "pattern")

    def test_takes_an_image_of_the_projectors_size_alone(self):
        with self.service.client() as client:
            png = base64.b64encode(self.pattern().read_bytes()).decode()
            client.call("project", picture="image", png=png)
            self.assertEqual(shows(client), "held")
            small = base64.b64encode((SCENE / "small.png").read_bytes()).decode()
            for params, name, words in (({"png": small}, "mismatch", "640x480 pixels, the projector 1280x800"),
                                        ({"png": "bm8="}, "malformed", ""), ({"png": "no"}, "invalid_params", "base64"),
                                        ({}, "invalid_params", "base64"),
                                        ({"picture": "white", "png": png}, "invalid_params", "only with"),
                                        ({"picture": "square"}, "invalid_params", "picture")):
                with self.subTest(params=str(params)[:40]), self.assertRaises(RpcError) as caught:
                    client.call("project", **{"picture": "image", **params})
                self.assertIn(caught.exception.name, {name, "unsupported" if name == "malformed" else name})
                self.assertIn(words, str(caught.exception))
            self.assertEqual(shows(client), "held")

    def test_grid_needs_a_calibration(self):
        with Service(configuration="[server]\nsocket = 'slsd.sock'\n") as service, service.client() as client:
            with self.assertRaises(RpcError) as caught:
                client.call("project", picture="grid")
            self.assertEqual(caught.exception.name, "not_found")

    def test_command_shows_names_and_files(self):
        def project(*arguments):
            return slsctl("--socket", self.service.socket, "project", *arguments)
        for picture in ("focus", "grid", "idle", self.pattern()):
            result = project(picture)
            self.assertEqual((result.returncode, result.stdout), (0, ""), result.stderr)
        self.assertIn('{"picture":"image"}', slsctl("--json", "--socket", self.service.socket, "project",
                                                    self.pattern()).stdout)
        small = project(SCENE / "small.png")
        self.assertEqual(small.returncode, 1)
        self.assertIn("640x480 pixels, the projector 1280x800", small.stderr)
        self.assertIn("missing.png", project(self.folder / "missing.png").stderr)
        for usage in (["nonsense"], ["image"], []):
            self.assertEqual(project(*usage).returncode, 2, usage)
        self.assertEqual(project("focus").returncode, 0)
        seen = self.folder / "seen.png"
        self.assertEqual(slsctl("--socket", self.service.socket, "frame", "--as-shown", seen).returncode, 0)
        self.assertIn("shows held", slsctl("--socket", self.service.socket, "status").stdout)


class TakenOver(unittest.TestCase):
    """A client's file has made what decodes it do something else."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        shutil.copy(BIN / "slsd", self.folder)

    def refusal(self, script, timeout_ms=30000):
        if script:
            (self.folder / "slsd-picture").write_text(f"#!/bin/sh\n{script}\n", encoding="ascii")
            (self.folder / "slsd-picture").chmod(0o755)
        with Service(program=self.folder / "slsd") as service, service.client() as client:
            with self.assertRaises(RpcError) as caught:
                client.call("project", picture="image", png="bm8=", timeout_ms=timeout_ms)
            self.assertGreater(client.call("scan")[0]["points"], 2000)
        return caught.exception

    def test_its_death_is_an_error(self):
        refused = self.refusal("kill -SEGV $$")
        self.assertEqual(refused.name, "malformed")
        self.assertIn("killed by signal 11", str(refused))

    def test_its_silence_is_over_in_time(self):
        self.assertEqual(self.refusal("exec sleep 1000", timeout_ms=500).name, "timeout")

    def test_its_answer_is_counted(self):
        self.assertEqual(self.refusal("echo ok; exec cat /dev/zero").name, "malformed")

    def test_without_it_no_image_is_shown(self):
        refused = self.refusal(None)
        self.assertEqual(refused.name, "not_found")
        self.assertIn("slsd-picture: is not installed", str(refused))


class Idle(unittest.TestCase):
    def test_is_black_but_for_scans(self):
        with Service(configuration=IDLE) as service, service.client() as client:
            for _ in range(3):
                wait_until(lambda: shows(client) == "idle", "the idle picture")
                self.assertGreater(client.call("scan")[0]["points"], 2000)
            client.call("project", picture="pattern")
            client.call("project", picture="idle")
            self.assertEqual(shows(client), "idle")
            client.call("subscribe", rate_hz=100)
            while len(client.events) < 3:
                client.events.append(client.receive())
            self.assertEqual(shows(client), "pattern")


if __name__ == "__main__":
    unittest.main(verbosity=2)
