#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsctl with a running service: files, pictures, messages, exit statuses."""
import json
import os
import pathlib
import pty
import signal
import subprocess
import tempfile
import unittest

from clipped_frame import write_clipped
from service import BIN, SCENE, Service, slsctl, slsd


class Slsctl(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)

    def slsctl(self, *arguments):
        return slsctl("--socket", self.service.socket, *arguments)

    def test_scan_writes_cloud_and_pictures(self):
        ply, pcd, seen, drawn = (self.folder / name for name in ("c.ply", "c.pcd", "seen.png", "drawn.png"))
        result = self.slsctl("scan", "-o", ply, "--picture", seen, "--cloud-picture", drawn)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("points", result.stdout)
        self.assertEqual(self.slsctl("scan", "-o", pcd).returncode, 0)
        self.assertTrue(ply.read_bytes().startswith(b"ply\n"))
        self.assertTrue(pcd.read_bytes().startswith(b"# .PCD"))
        for picture in (seen, drawn):
            self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))

    def test_scan_says_why_symbols_are_missing(self):
        plain, why = self.folder / "seen.png", self.folder / "why.png"
        self.assertEqual(self.slsctl("scan", "--picture", plain).returncode, 0)
        result = self.slsctl("scan", "--picture", why, "--why")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(why.read_bytes().startswith(b"\x89PNG"))
        self.assertNotEqual(plain.read_bytes(), why.read_bytes())
        self.assertRegex(result.stdout, r"\n +\d+ touches_border: The region touches the border.*Move the object")
        told = json.loads(self.slsctl("scan", "--picture", why, "--why", "--json").stdout)
        for reason in told["reasons"]:
            self.assertEqual(reason["regions"], told["rules"][reason["rule"]])
            self.assertIn(reason["kind"], ("rejects", "guards"))
            if reason["kind"] == "rejects":
                self.assertGreaterEqual(told["regions"][reason["status"]], reason["regions"])
        rejected = sum(reason["regions"] for reason in told["reasons"] if reason["kind"] == "rejects")
        self.assertEqual(rejected, sum(told["regions"].values()) - told["regions"]["decoded"])
        lone = self.slsctl("scan", "-o", self.folder / "c.ply", "--why")
        self.assertEqual(lone.returncode, 2)
        self.assertIn("--picture", lone.stderr)
        self.assertRegex(self.slsctl("status").stdout, r"  rules +last +all\n(  .*\n)*  touches_border +\d")

    def test_images_are_written(self):
        for command in ("frame", "pattern", "preview"):
            file = self.folder / (command + ".png")
            self.assertEqual(self.slsctl(command, file).returncode, 0)
            self.assertTrue(file.read_bytes().startswith(b"\x89PNG"))
            for option in ("-o", "--output"):
                file.unlink()
                self.assertEqual(self.slsctl(command, option, file).returncode, 0)
                self.assertTrue(file.read_bytes().startswith(b"\x89PNG"))

    def test_cloud_is_named_with_or_without_an_option(self):
        cloud = self.folder / "c.ply"
        self.assertEqual(self.slsctl("scan", cloud).returncode, 0)
        self.assertTrue(cloud.read_bytes().startswith(b"ply\n"))
        self.assertEqual(self.slsctl("scan", self.folder / "c.xyz").returncode, 2)
        self.assertEqual(self.slsctl("scan", cloud, "-o", cloud).returncode, 2)

    def test_the_end_of_a_name_may_be_in_capitals(self):
        for name, begin in (("C.PLY", b"ply\n"), ("c.Pcd", b"# .PCD")):
            self.assertEqual(self.slsctl("scan", self.folder / name).returncode, 0)
            self.assertTrue((self.folder / name).read_bytes().startswith(begin))
        self.assertEqual(self.slsctl("frame", self.folder / "F.PNG").returncode, 0)
        self.assertEqual(slsd("--pattern", self.folder / "P.PNG").returncode, 0)
        self.assertEqual(slsd("--print-board", self.folder / "B.SVG").returncode, 0)
        self.assertEqual(self.slsctl("project", self.folder / "P.PNG").returncode, 0)

    def test_standard_output_has_the_bytes_and_nothing_else(self):
        for command, begin in ((["scan", "-o", "-"], b"ply\n"), (["scan", "-", "--format", "pcd"], b"# .PCD"), (["frame", "-"], b"\x89PNG"),
                               (["preview", "-o", "-", "--json"], b"\x89PNG"), (["pattern", "-"], b"\x89PNG"), (["bundle", "-"], b"bundle.json"),
                               (["metrics", "-o", "-"], b"# "), (["scan", "--picture", "-"], b"\x89PNG")):
            with self.subTest(command=command):
                done = subprocess.run([BIN / "slsctl", "--socket", self.service.socket, *command], capture_output=True, check=True,
                                      cwd=self.folder)
                self.assertTrue(done.stdout.startswith(begin), done.stdout[:100])
                self.assertNotIn(b" regions, capture ", done.stdout)
                self.assertEqual(b" regions, capture " in done.stderr, command[0] == "scan")
        self.assertEqual(list(self.folder.iterdir()), [])
        failed = self.slsctl("scan", "-", "--camera", "none", "--picture", self.folder / "p.png", "--json")
        self.assertEqual((failed.returncode, failed.stdout), (1, ""))
        self.assertEqual(json.loads(failed.stderr)["error"]["data"]["name"], "not_found")

    def on_terminal(self, *arguments):
        """Its exit status and what a terminal shows."""
        process, terminal = pty.fork()
        if process == 0:
            os.execv(BIN / "slsctl", ["slsctl", "--socket", str(self.service.socket), *arguments])
        shown = b""
        while True:
            try:
                shown += os.read(terminal, 4096)
            except OSError:  # it ended
                break
        os.close(terminal)
        return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), shown.decode()

    def test_no_bytes_for_a_terminal(self):
        for command in (["scan", "-o", "-"], ["frame", "-"], ["bundle", "-"]):
            status, shown = self.on_terminal(*command)
            self.assertEqual(status, 2)
            self.assertIn("standard output is a terminal", shown)
        self.assertEqual(self.on_terminal("metrics", "-o", "-")[0], 0)

    def test_a_terminal_shows_for_how_long_it_waits(self):
        self.service.send_signal(signal.SIGSTOP)
        process, terminal = pty.fork()
        if process == 0:
            os.execv(BIN / "slsctl", ["slsctl", "--socket", str(self.service.socket), "scan", "--density", "pixels", "--timeout-ms",
                                      "600000"])
        shown = b""
        while b"measuring every pixel, " not in shown:
            shown += os.read(terminal, 4096)
        self.service.send_signal(signal.SIGCONT)
        try:
            while True:
                shown += os.read(terminal, 4096)
        except OSError:
            pass
        os.close(terminal)
        self.assertEqual(os.waitpid(process, 0)[1], 0, shown)
        self.assertRegex(shown.decode(), r"^\rmeasuring every pixel, \d+ s(.|\r)*\r +\rscan ")

    def test_an_unwritable_place_is_noticed_before_a_scan(self):
        scans = json.loads(self.slsctl("status", "--json").stdout)["scans"]["succeeded"]
        (self.folder / "folder.ply").mkdir()
        places = {self.folder / "missing" / "c.ply": "missing", self.folder / "folder.ply": "is a folder"}
        for place, expected in places.items():
            for command in (["scan", place], ["scan", "--picture", place.with_suffix(".png")], ["bundle", place.with_suffix(".tar")]):
                if command[-1].parent.exists() and not command[-1].exists():
                    continue
                with self.subTest(command=command):
                    result = self.slsctl(*command)
                    self.assertEqual((result.returncode, result.stdout), (1, ""))
                    self.assertIn(expected, result.stderr)
        self.assertEqual(json.loads(self.slsctl("status", "--json").stdout)["scans"]["succeeded"], scans)

    def test_a_scan_that_fails_leaves_the_old_file(self):
        cloud = self.folder / "c.ply"
        cloud.write_bytes(b"mine")
        self.assertEqual(self.slsctl("scan", cloud, "--picture", self.folder / "p.png", "--camera", "none").returncode, 1)
        self.assertEqual(cloud.read_bytes(), b"mine")
        self.assertEqual(list(self.folder.iterdir()), [cloud])

    def test_a_camera_is_named(self):
        for command in ("frame", "preview"):
            file = self.folder / (command + ".png")
            self.assertEqual(self.slsctl(command, file, "--camera", "camera").returncode, 0)
            result = self.slsctl(command, file, "--camera", "camra")
            self.assertEqual(result.returncode, 1)
            self.assertIn('no camera is called "camra"; configured: camera', result.stderr)

    def test_a_depth_map_and_normals_are_of_pixels(self):
        done = self.slsctl("scan", self.folder / "d.tiff", "--timeout-ms", "600000")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / "d.tiff").read_bytes()[:2], b"II")

    def test_the_environment_names_the_socket(self):
        for named, arguments, status in ((self.service.socket, [], 0), ("/nonexistent/slsd.sock", [], 3),
                                         ("/nonexistent/slsd.sock", ["--socket", self.service.socket], 0),
                                         (self.service.socket, ["--socket", "/nonexistent/slsd.sock"], 3)):
            with self.subTest(named=named, arguments=arguments):
                self.assertEqual(slsctl(*arguments, "status", env={**os.environ, "SLSD_SOCKET": str(named)}).returncode, status)

    def test_where_no_service_answers_the_others_are_named(self):
        result = slsctl("--socket", self.service.folder / "other.sock", "status")
        self.assertEqual(result.returncode, 3)
        self.assertIn(f"there are {self.service.socket}", result.stderr)
        self.assertIn("--socket or SLSD_SOCKET", result.stderr)

    def test_a_service_that_hangs_is_told(self):
        with Service() as service:
            service.send_signal(signal.SIGSTOP)
            for command in (["status"], ["scan"], ["watch"]):
                with self.subTest(command=command):
                    result = slsctl("--socket", service.socket, *command)
                    self.assertEqual(result.returncode, 1)
                    self.assertIn("the service does not answer: check its log, or restart it", result.stderr)
            service.send_signal(signal.SIGCONT)

    def test_a_reader_that_leaves_ends_it(self):
        for command in ("watch", "top --interval 0.1", "--json watch", "metrics", "scan -o -"):
            with self.subTest(command=command):
                done = subprocess.run(["bash", "-c", f"'{BIN}/slsctl' --socket '{self.service.socket}' {command} | head -c 4"],
                                      capture_output=True, timeout=120, check=False)
                self.assertEqual(len(done.stdout), 4)
        for command in ("status", "watch", "settings", "scan", "scan -o -", "--json status"):
            with self.subTest(command=command):
                done = subprocess.run(["bash", "-c", f"'{BIN}/slsctl' --socket '{self.service.socket}' {command} >/dev/full"],
                                      capture_output=True, timeout=120, check=False, text=True)
                self.assertEqual(done.returncode, 1)
                self.assertRegex(done.stderr, "standard output.*(disk is full|No space left)")

    def test_json_works_everywhere(self):
        self.assertIn("points", json.loads(self.slsctl("--json", "scan").stdout))
        self.assertIn("version", json.loads(self.slsctl("status", "--json").stdout))
        lines = self.slsctl("watch", "--json", "--count", "2").stdout.splitlines()
        self.assertEqual([json.loads(line)["method"] for line in lines], ["cloud", "cloud"])
        self.assertIn("bytes", json.loads(self.slsctl("frame", self.folder / "f.png", "--json").stdout))
        error = json.loads(slsctl("--socket", self.folder / "none", "--json", "status").stdout)["error"]
        self.assertEqual(error["data"]["name"], "not_found")

    def test_exposure_proposes_and_names_what_it_cannot_mend(self):
        seen = json.loads(self.slsctl("--json", "exposure").stdout)
        self.assertEqual((seen["camera"], seen["full"], seen["present"]), ("camera", 255, None))
        self.assertEqual((seen["noise"], seen["moved_share"], seen["troubles"]), (0, 0, []))
        self.assertGreater(seen["lit"], 100)
        self.assertGreater(seen["patterned_share"], 0.5)
        self.assertIn("brightness: ", self.slsctl("exposure", "--camera", "camera").stdout)
        self.assertEqual(self.slsctl("exposure", "--camera", "other").returncode, 1)
        self.assertEqual(self.slsctl("exposure", "--gain-max-db", "-1").returncode, 2)
        with Service(camera_path=SCENE / "black.png") as dark:
            self.assertIn("no_pattern: ", slsctl("--socket", dark.socket, "exposure").stdout)

    def test_light_reports_in_numbers_and_as_a_picture(self):
        picture = self.folder / "light.png"
        seen = json.loads(self.slsctl("--json", "light", "--camera", "camera", "--picture", picture).stdout)
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
        self.assertEqual((seen["camera"], seen["full"], seen["troubles"]), ("camera", 255, []))
        self.assertEqual(seen["change"], {"noise": 0, "moved_share": 0, "brighter": 1, "bands": 0})
        self.assertEqual((seen["grain"], seen["gamma"]), (None, None), "measured without noise")
        self.assertLess(0.5, seen["edge_px"])
        self.assertLess(seen["edge_px"], 0.075 * seen["period_px"])
        self.assertLess(seen["room_light"], 0.5)
        self.assertEqual(seen["clipped_of_lit"], 0)
        self.assertLess(seen["pitch"]["unevenness_px"], 0.005 * seen["pitch"]["pitch_px"])
        told = self.slsctl("light").stdout
        for line in ("blur   ", "clipped   ", "room light   ", "noise   ", "grain   ", "gamma   ", "change   ", "pitch   "):
            self.assertIn("\n" + line, told)

    def test_light_reads_files_without_a_service(self):
        frame, none = SCENE / "frame.png", self.folder / "none"
        seen = json.loads(slsctl("--socket", none, "--json", "light", "--from", frame).stdout)
        self.assertEqual((seen["camera"], seen["change"], seen["troubles"]), ("", None, []))
        clipped = write_clipped(self.folder / "clipped.pgm")
        seen = json.loads(slsctl("--socket", none, "--json", "light", "--from", clipped, clipped).stdout)
        self.assertEqual([trouble["name"] for trouble in seen["troubles"]], ["clipped"])
        self.assertAlmostEqual(seen["clipped_of_lit"], 1)
        small = self.folder / "small.pgm"
        small.write_bytes(b"P5 64 64 255\n" + bytes(64 * 64))
        self.assertIn("no_pattern: ", slsctl("light", "--from", small).stdout)
        self.assertIn("64x64 pixels of 8 bits, the other 640x480", slsctl("light", "--from", clipped, small).stderr)
        self.assertEqual(slsctl("light", "--from", clipped, small).returncode, 1)
        self.assertIn("missing.png", slsctl("light", "--from", self.folder / "missing.png").stderr)
        for usage in (["--from", frame, "--camera", "camera"], ["--picture", "light.jpg"], ["--from"]):
            self.assertEqual(slsctl("light", *usage).returncode, 2, usage)

    def test_exposure_and_light_name_the_same_troubles(self):
        with Service(camera_path=write_clipped(self.folder / "clipped.pgm")) as service:
            told = [json.loads(slsctl("--socket", service.socket, "--json", command).stdout)["troubles"]
                    for command in ("exposure", "light")]
            self.assertEqual([trouble["name"] for trouble in told[0]], ["clipped"])
            self.assertEqual(told[0], told[1])
            self.assertIn(told[0][0]["remedy"], slsctl("--socket", service.socket, "exposure").stdout)

    def test_status_and_watch_read_well(self):
        self.assertIn("camera      ready, file", self.slsctl("status").stdout)
        self.assertEqual(len(self.slsctl("watch", "--count", "2").stdout.splitlines()), 2)

    def test_exit_status_tells_the_kind_of_failure(self):
        self.assertEqual(slsctl("--socket", self.folder / "none", "scan").returncode, 3)
        self.assertEqual(slsctl("--socket", "x" * 200, "scan").returncode, 1)
        for usage in (["scan", "-o", "cloud.xyz"], ["frame"], ["nonsense"], [], ["scan", "--timeout-ms", "0"]):
            self.assertEqual(self.slsctl(*usage).returncode, 2, usage)
        missing = self.slsctl("scan", "-o", self.folder / "missing" / "c.ply")
        self.assertEqual(missing.returncode, 1)
        self.assertIn("missing", missing.stderr)

    def test_full_disk_is_an_error(self):
        result = self.slsctl("frame", "/dev/full")
        self.assertEqual(result.returncode, 1)
        self.assertIn("/dev/full", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
