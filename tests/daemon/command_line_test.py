#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The two command lines from outside: exit statuses, files, messages."""
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from service import BIN, SCENE, Service, slsctl, slsd, wait_until

WRONG_CONFIGURATION = 78
# --check measures dense clouds too: where a test looks at something else, in a third of the time.
COARSE = "\n[decode]\ndense_stride_px = 8\n"


class Slsd(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        self.file = self.folder / "slsd.toml"

    def test_helps_and_tells_its_version(self):
        for program in (slsd, slsctl):
            self.assertEqual(program("--help").returncode, 0)
            self.assertRegex(program("--version").stdout, r"^slsd|slsctl \d+\.\d+")
            self.assertEqual(program("--nonsense").returncode, 2)

    def test_writes_the_pattern_without_a_configuration(self):
        image = self.folder / "pattern.png"
        self.assertEqual(slsd("--pattern", image).returncode, 0)
        header = image.read_bytes()[:24]
        self.assertEqual(header[:4], b"\x89PNG")
        self.assertEqual((int.from_bytes(header[16:20], "big"), int.from_bytes(header[20:24], "big")), (1280, 800))

    def test_takes_no_option_for_a_value(self):
        for option in ("--pattern", "--config", "--print-board"):
            with self.subTest(option=option):
                result = slsd(option, "--help", cwd=self.folder)
                self.assertEqual(result.returncode, 2)
                self.assertIn("a value is missing before --help", result.stderr)
        for command in (["frame", "--output", "--json"], ["scan", "--picture", "--normals"], ["--socket", "--json", "status"],
                        ["calibrate", "--board", "--resume"]):
            with self.subTest(command=command):
                result = slsctl(*command, cwd=self.folder)
                self.assertEqual(result.returncode, 2)
                self.assertRegex(result.stderr, "a value is missing before --(json|normals|resume)")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_pattern_follows_the_configuration(self):
        self.file.write_text("[projector]\ndriver = 'glfw'\nwidth_px = 640\nheight_px = 360\n", encoding="utf-8")
        image = self.folder / "pattern.png"
        self.assertEqual(slsd("--pattern", image, "--config", self.file).returncode, 0)
        self.assertEqual(int.from_bytes(image.read_bytes()[16:20], "big"), 640)

    def test_names_what_is_wrong_with_a_configuration(self):
        cases = {"[pattern]\nsymbols = [7]\n": ":2:", '"x\\u001b[31m" = 1\n': "no such table or key: x\\x1b[31m",
                 "[[camera]]\npath = 'x'\nname = \"\\n\"\n": "without control characters", "[[camera]]\npath = 3\n": ":2:8: [[camera]] path",
                 "[camera]\n": "[[camera]]", "x = \n": ":1:", "[projector]\nbrightness = 2\n": "brightness must be 0 to 1",
                 "[[camera]]\ndriver = 'aravis'\n": "id must be the camera's serial number",
                 "[calibration]\nfile = 'slsd.toml'\n": "slsd.toml:2:",
                 "[calibration]\nfile = '.'\n": "is a folder",
                 "#" * 10_000_000: "is 10000000 bytes long, more than the limit of 1048576 bytes"}
        for text, expected in cases.items():
            with self.subTest(text=text):
                self.file.write_text(text, encoding="utf-8")
                self.assert_not_started(self.file, expected, WRONG_CONFIGURATION)
        self.assert_not_started(self.folder / "missing.toml", "missing.toml", WRONG_CONFIGURATION)
        self.assert_not_started(self.folder, "is a folder", WRONG_CONFIGURATION)
        self.assert_not_started("/dev/null", "is not a regular file", WRONG_CONFIGURATION)

    def test_configuration_that_may_not_be_read_is_named(self):
        if os.geteuid() == 0:
            self.skipTest("root may read everything")
        self.file.write_text("", encoding="utf-8")
        self.file.chmod(0)
        self.assert_not_started(self.file, "Permission denied", WRONG_CONFIGURATION)

    def test_start_that_may_succeed_later_is_told_from_one_that_may_not(self):
        for text in ("[calibration]\nfile = 'missing.yml'\n", "[pattern]\nfile = 'missing.toml'\n",
                     "[server]\nsocket = 'missing/slsd.sock'\n"):
            with self.subTest(text=text):
                self.file.write_text(text, encoding="utf-8")
                self.assert_not_started(self.file, "missing", 1)

    def assert_not_started(self, file, expected, status):
        """By one error, in one line, and nothing else."""
        result = slsd("--config", file)
        self.assertEqual(result.returncode, status, result.stderr)
        lines = [line for line in result.stderr.splitlines() if " critical " in line]
        self.assertEqual(len(lines), 1, result.stderr)
        self.assertIn(expected, lines[0])

    def test_check_config_looks_at_the_configuration_alone(self):
        service = Service(camera_path="/nowhere")  # a camera that does not open is none of its business
        result = slsd("--check-config", "--config", service.file)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn(f"ok       configuration {service.file}", result.stdout)
        cases = {"[server]\nclients_min = 3\n": "did you mean",
                 "[server]\nwhistle = 3\n": "is the configuration for another version?",
                 "[server]\nscan = ['@no-such-group']\n": "no-such-group",
                 "[calibration]\nfile = 'slsd.toml'\n": "slsd.toml:2:"}
        for text, expected in cases.items():
            with self.subTest(text=text):
                self.file.write_text(text, encoding="utf-8")
                result = slsd("--check-config", "--config", self.file)
                self.assertIn(expected, result.stderr)
                self.assertEqual(result.returncode, 1 if "no-such-group" in text else WRONG_CONFIGURATION)

    def test_check_finds_what_forbids_a_scan(self):
        service = Service(camera_path=SCENE / "small.png", camera=COARSE)
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("640x480 px, but its calibration is for 1600x1200 px", result.stdout)
        service = Service(camera=COARSE)
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 0, result.stdout)

    def checked_with(self, change, decode=""):
        """What --check says with another calibration."""
        service = Service()
        text = change((SCENE / "calibration.yml").read_text(encoding="utf-8"))
        (service.folder / "other.yml").write_text(text, encoding="utf-8")
        configuration = service.file.read_text(encoding="utf-8")
        service.file.write_text(configuration.replace(f"{SCENE}/calibration.yml", "other.yml") + decode, encoding="utf-8")
        return slsd("--check", "--config", service.file).stdout

    def test_check_says_what_dense_clouds_would_give(self):
        said = self.checked_with(lambda text: text)
        self.assertRegex(said, r'ok +dense clouds of camera "camera", at 1000 mm: resolves parts from \d+\.\d mm, and half the height '
                               r'of waves \d+\.\d mm long; .* points of 1920000 pixels in \d+ ms per frame, in \d+ ms .* still scene. Memory: \d+ MB')
        self.assertNotIn("dense_stride_px", said)
        self.assertNotIn("calibrate again", said)

    def test_check_warns_of_a_calibration_that_is_far_off(self):
        said = self.checked_with(lambda text: text + "\nreprojection_error_projector_px: 0.62\n", COARSE)
        self.assertIn("warning  the calibration's reprojection error in the projector is 0.62 px", said)

    def test_check_warns_of_a_pattern_that_is_too_coarse(self):
        def nearer(text):
            matrix = re.search(r"camera_matrix:.*?data: \[(.*?)\]", text, re.S).group(1)
            values = [float(value) for value in matrix.split(",")]
            values[0], values[4] = 3 * values[0], 3 * values[4]
            return text.replace(matrix, ", ".join(map(repr, values)))
        self.assertIn("the pattern is too coarse for this camera", self.checked_with(nearer, COARSE))

    def test_check_names_the_stride_that_memory_allows(self):
        larger = lambda text: text.replace("width: 1600", "width: 3200", 1)
        said = self.checked_with(larger, "\n[decode]\ndense_stride_px = 1\n")
        self.assertIn("dense_stride_px = 1 would need too much memory", said)

    def test_warns_of_symbols_that_look_alike(self):
        self.file.write_text("[pattern]\nsymbol_size_px = 8\nsymbols = [1, 7, 22, 25]\n", encoding="utf-8")
        self.assertIn("warning  symbol", slsd("--check", "--config", self.file).stdout)

    def test_latency_refuses_what_sees_no_flash(self):
        service = Service()
        result = slsd("--calibrate", "--latency", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("camera camera: the camera saw no flash", result.stderr)
        self.assertEqual(slsd("--latency", "--config", service.file).returncode, 2)

    def test_a_session_ends_at_an_interrupt_and_says_what_it_has(self):
        service = Service()
        with subprocess.Popen([BIN / "slsd", "--calibrate", "--config", service.file], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as session:
            self.assertIn("Ctrl-C ends the session", session.stdout.readline())
            session.send_signal(signal.SIGINT)
            _, problem = session.communicate(timeout=120)
        self.assertEqual(session.returncode, 1)
        self.assertIn("ended with 0 poses", problem)

    def test_calibrating_and_verifying_say_what_they_lack(self):
        service = Service()
        for command in ("--calibrate", "--verify"):
            result = slsd(command, "--from", self.folder, "--config", service.file)
            self.assertEqual(result.returncode, 1, command)
            self.assertIn("has no pose", result.stderr)
        for usage in (["--from", self.folder], ["--board", "charuco"], ["--calibrate", "--verify"], ["--poses", "5"],
                      ["--verify", "--ruler", "200:201"],
                      ["--plane", "plane:8x5:100:40:DICT_4X4_50"], ["--calibrate", "--planes", "2"]):
            self.assertEqual(slsd(*usage).returncode, 2, usage)

    def test_check_compares_latency_and_exposure_with_the_configuration(self):
        service = Service(camera=COARSE)
        latency = "[[camera]]\nname = 'camera'\nflashes = 20\nlatency_us = 51234\n"
        text = service.file.read_text(encoding="utf-8").replace(f"{SCENE}/calibration.yml", "calibration.yml")
        service.file.write_text(text, encoding="utf-8")
        shutil.copy(SCENE / "calibration.yml", service.folder)
        (service.folder / "latency.toml").write_text(latency, encoding="utf-8")
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn("warning  camera \"camera\" saw complete images only 51.2 ms", result.stdout)
        self.assertIn("set 52", result.stdout)
        (service.folder / "latency.toml").write_text("latency = 1\n", encoding="utf-8")
        self.assertEqual(slsd("--check", "--config", service.file).returncode, 1)
        self.file.write_text("[[camera]]\ndriver = 'v4l2'\ndevice = '/nothing'\nexposure_us = 20000\n", encoding="utf-8")
        self.assertIn("set 16667 or 33333", slsd("--check", "--config", self.file).stdout)

    def test_check_names_the_troubles_of_the_light(self):
        troubled = Service(camera_path=write_clipped(self.folder / "clipped.pgm"), camera=COARSE)
        self.assertIn('warning  camera "camera": clipped: symbols are clipped', slsd("--check", "--config", troubled.file).stdout)
        self.assertNotRegex(slsd("--check", "--config", Service(camera=COARSE).file).stdout, "clipped|blurred|ambient|no_pattern")

    def test_check_of_a_running_service_is_no_error(self):
        with Service(camera=COARSE) as service:
            service.wait_ready()
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertIn('ok       camera "camera": in use by the service, ready', result.stdout)
            self.assertIn("ok       projector: in use by the service, ready", result.stdout)
            self.assertNotIn("opens", result.stdout)
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text + "clients_max = 7\n", encoding="utf-8")
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertIn("warning  service: [server] differs from this file", result.stdout)

    def test_check_asks_the_service_of_a_camera_that_it_has_lost(self):
        folder = self.folder / "frames"
        folder.mkdir()
        shutil.copy(SCENE / "frame.png", folder)
        with Service(camera_path=folder, camera=COARSE) as service:
            service.wait_ready()
            shutil.rmtree(folder)
            with service.client() as client:
                wait_until(lambda: client.call("status")[0]["cameras"][0]["state"] == "absent", "the loss")
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertRegex(result.stdout, 'error    camera "camera": the service reports it as absent: .*frames')

    def test_check_names_the_configuration_of_another_service(self):
        with Service(camera=COARSE) as service:
            other = service.folder / "other.toml"
            shutil.copy(service.file, other)
            result = slsd("--check", "--config", other)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn(f"the service at this socket has another configuration, {service.file}", result.stdout)
            self.assertIn('ok       camera "camera" opens', result.stdout)

    def test_check_leaves_the_devices_of_a_service_that_hangs_alone(self):
        with Service(camera=COARSE) as service:
            service.wait_ready()
            service.send_signal(signal.SIGSTOP)
            result = slsd("--check", "--config", service.file)
            service.send_signal(signal.SIGCONT)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn("the service does not answer", result.stdout)
            self.assertNotIn("opens", result.stdout)

    def test_lists_devices(self):
        service = Service()
        result = slsd("--list", "--config", service.file)
        self.assertEqual(result.returncode, 0)
        self.assertIn('configured camera "camera", driver file: replays', result.stdout)

    def test_list_invents_no_projector(self):
        for text, first in (("", "no projector is configured"),
                            ("[projector]\ndriver = 'glfw'\nwidth_px = 640\nheight_px = 480\n", "configured projector: driver glfw, 640x480 px")):
            self.file.write_text(text, encoding="utf-8")
            self.assertTrue(slsd("--list", "--config", self.file).stdout.startswith(first))

    def test_lists_devices_as_json(self):
        service = Service()
        result = slsd("--list", "--json", "--config", service.file)
        self.assertEqual(result.returncode, 0, result.stderr)
        listed = json.loads(result.stdout)
        self.assertEqual(listed["configured"], [{"name": "camera", "driver": "file", "seen": True}])
        self.assertTrue(any(place.startswith("GigE Vision: by broadcast on") for place in listed["looked_at"]))

    def test_json_is_for_lists(self):
        self.assertEqual(slsd("--json", "--check").returncode, 2)

    def test_check_names_cameras_to_choose_for_one_that_is_absent(self):
        service = Service(configuration='[[camera]]\ndriver = "v4l2"\ndevice = "/dev/no-such-camera"\n')
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stdout, "(?s)no-such-camera.*No such file.*(found with this driver|no other camera of this driver)")


COMMANDS = {"scan", "record", "status", "watch", "top", "metrics", "calibrate", "exposure", "light", "project", "frame", "set", "settings",
            "preview", "pattern", "bundle"}


def write_clipped(file):
    """A camera's image of a pattern with saturated symbols."""
    rows = [bytes(255 if x % 16 < 8 and y % 16 < 8 else 20 for x in range(640)) for y in range(16)]
    file.write_bytes(b"P5 640 480 255\n" + b"".join(rows[y % 16] for y in range(480)))
    return file


class Usage(unittest.TestCase):
    """What needs no service: help, and what is wrong with a command line."""

    def refused(self, *arguments, program=slsctl):
        """What is said of a wrong usage, but for where help is."""
        result = program(*arguments)
        self.assertEqual((result.returncode, result.stdout), (2, ""), arguments)
        problem, help_is_at = result.stderr.splitlines()
        self.assertRegex(help_is_at, r'^see "sls(ctl|d)[a-z ]* --help"$')
        return problem

    def test_lists_its_commands_when_called_alone(self):
        result = slsctl()
        self.assertEqual((result.returncode, result.stdout), (2, ""))
        self.assertEqual(set(re.findall(r"(?m)^  ([a-z]+)  ", result.stderr)), COMMANDS)
        self.assertTrue(result.stderr.endswith("slsctl: choose one of these commands\n"))

    def test_help_has_groups_and_each_command_examples(self):
        text = slsctl("--help").stdout
        groups = [text.index(f"\n{group}:\n") for group in ("Measure", "Watch", "Set up", "Diagnose")]
        self.assertEqual(groups, sorted(groups))
        self.assertIn("SLSD_SOCKET", text)
        for command in COMMANDS:
            with self.subTest(command=command):
                result = slsctl(command, "--help")
                self.assertEqual(result.returncode, 0)
                self.assertIn(f"Examples:\n  slsctl {command}", result.stdout)
                self.assertEqual(slsctl("help", command).stdout, result.stdout)

    def test_examples_of_the_help_are_sound(self):
        for command in COMMANDS:
            for line in re.findall(r"(?m)^  slsctl (.*)", slsctl(command, "--help").stdout):
                with self.subTest(line=line):
                    words = line.split(" | ")[0].split()
                    if "chart.png" not in words and words[0] not in ("bundle", "metrics"):
                        self.assertEqual(slsctl("--socket", "/nonexistent/slsd.sock", *words).returncode, 3)

    def test_names_the_nearest_command_option_and_value(self):
        cases = {("sttaus",): 'slsctl: there is no command "sttaus"; did you mean status?',
                 ("help", "recrod"): 'slsctl: there is no command "recrod"; did you mean record?',
                 ("xyzzy",): 'slsctl: there is no command "xyzzy"',
                 ("scan", "--densty", "pixels"): 'slsctl scan: there is no option "--densty"; did you mean --density?',
                 ("scan", "--densty=pixels"): 'slsctl scan: there is no option "--densty"; did you mean --density?',
                 ("frame", "f.png", "--as-show"): 'slsctl frame: there is no option "--as-show"; did you mean --as-shown?',
                 ("frame", "--camra", "left"): 'slsctl frame: there is no option "--camra"; did you mean --camera?',
                 ("status", "--sokcet", "x"): 'slsctl status: there is no option "--sokcet"; did you mean --socket?',
                 ("-json", "status"): 'slsctl status: there is no option "-json"; did you mean --json?',
                 ("watch", "--texture"): 'slsctl watch: there is no option "--texture" here: it belongs to slsctl scan',
                 ("scan", "--density", "pixel"): 'slsctl scan: --density: "pixel" is not one of symbols, pixels; did you mean pixels?',
                 ("scan", "--timeout-ms", "0"): 'slsctl scan: --timeout-ms: "0" is not a number from 1 to 600000',
                 ("watch", "--count", "1.5"): "slsctl watch: --count takes a whole number",
                 ("watch", "--count"): "slsctl watch: --count needs a value",
                 ("status", "now"): 'slsctl status: unexpected argument "now"',
                 ("frame",): "slsctl frame: FILE is missing: the PNG to write; - is standard output"}
        for arguments, problem in cases.items():
            with self.subTest(arguments=arguments):
                self.assertEqual(self.refused(*arguments), problem)
        self.assertIn("did you mean --calibrate?", self.refused("--calibrat", program=slsd))
        self.assertRegex(self.refused("--calibrate", "--verify", program=slsd), "--[a-z]+ and --[a-z]+ do not go together")

    def test_says_what_it_writes_before_it_asks_for_it(self):
        cases = {("scan", "c.xyz"): ".ply or .pcd", ("scan", "cloud"): ".tiff", ("scan", "c.ply", "--format", "pcd"): "format pcd",
                 ("frame", "f.jpg"): ".png", ("preview", "f.jpeg"): ".png", ("pattern", "p.svg"): ".png",
                 ("scan", "--picture", "x.tif"): ".png", ("scan", "--cloud-picture", "x.bmp"): ".png",
                 ("bundle", "b.zip"): ".tar", ("scan", "d.tiff", "--normals"): "no normals",
                 ("scan", "d.tif", "--density", "symbols"): "--density pixels", ("scan", "-", "--picture", "-"): "one file only",
                 ("scan", "d.TIFF", "--cloud-picture", "x.png"): "needs a cloud: write it as .ply"}
        for arguments, expected in cases.items():
            with self.subTest(arguments=arguments):
                self.assertIn(expected, self.refused(*arguments))
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            self.assertIn("must end in .png", slsd("--pattern", "p.jpg", cwd=folder).stderr)
            self.assertEqual(os.listdir(folder), [])


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
