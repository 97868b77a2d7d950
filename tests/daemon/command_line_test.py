#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The two command lines from outside: configuration, usage, help, messages."""
import json
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import unittest

from service import BIN, Service, slsctl, slsd

WRONG_CONFIGURATION = 78
COMMANDS = {"scan", "record", "status", "watch", "top", "metrics", "calibrate", "hand-eye", "exposure", "light", "project", "frame", "set", "settings",
            "datasheet", "plane", "preset", "preview", "pattern", "bundle"}


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
        for command in ("--calibrate", "--verify", "--correct"):
            result = slsd(command, "--from", self.folder, "--config", service.file)
            self.assertEqual(result.returncode, 1, command)
            self.assertIn("has no pose", result.stderr)
        for usage in (["--from", self.folder], ["--board", "charuco"], ["--calibrate", "--verify"], ["--poses", "5"],
                      ["--verify", "--ruler", "200:201"], ["--correct", "--ruler", "200:201"], ["--correct", "--verify"],
                      ["--undo"], ["--correct", "--undo", "--from", self.folder],
                      ["--plane", "plane:8x5:100:40:DICT_4X4_50"], ["--calibrate", "--planes", "2"]):
            self.assertEqual(slsd(*usage).returncode, 2, usage)

    def test_undoes_no_correction_that_was_not_made(self):
        service = Service()
        result = slsd("--correct", "--undo", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("nothing to undo", result.stderr)

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
        self.assertEqual(set(re.findall(r"(?m)^  ([a-z][a-z-]*)  ", result.stderr)), COMMANDS)
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
                        reads_folder = words[0] == "hand-eye" and "--pose=" not in line  # without a service
                        failure = 1 if reads_folder else 3
                        self.assertEqual(slsctl("--socket", "/nonexistent/slsd.sock", *words).returncode, failure)

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
                 ("scan", "a.ply", "--preset", ""): "slsctl scan: --preset: an empty value: is a variable unset? Leave the option out for its default",
                 ("scan", "a.ply", "--camera="): "slsctl scan: --camera needs a value",
                 ("status", "--socket", ""): "slsctl status: --socket: an empty value: is a variable unset? Leave the option out for its default",
                 ("status", "now"): 'slsctl status: unexpected argument "now"',
                 ("light", "--from", "a.png", "b.png", "c.png"):
                     'slsctl light: --from takes one or two frames of one camera, not 3: leave out "c.png"',
                 ("light", "--from", "a.png", "b.png", "c.png", "d.png", "--json"):
                     'slsctl light: --from takes one or two frames of one camera, not 4: leave out "c.png" and those after it',
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
