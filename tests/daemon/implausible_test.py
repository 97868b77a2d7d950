#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Calibrations in other units or directions: warned of by --check and the start, and empty clouds say why."""
import json
import re
import tempfile
import unittest
import pathlib

from service import CONFIGURATION, SCENE, Service, slsctl, slsd, wait_until

ADVICE = {"metres": "T looks like metres: multiply it by 1000", "inverted": "R and T look inverted"}


def numbers(text, key):
    found = re.search(rf"\b{key}: !!opencv-matrix\s+rows: \d+\s+cols: \d+\s+dt: d\s+data: \[([^\]]*)\]", text)
    return found, [float(number) for number in found.group(1).split(",")]


def put(text, key, values):
    found, _ = numbers(text, key)
    return text[:found.start(1)] + ", ".join(map(repr, values)) + text[found.end(1):]


def metres(text):
    return put(text, "T", [value / 1000 for value in numbers(text, "T")[1]])


def micrometres(text):
    return put(text, "T", [value * 1000 for value in numbers(text, "T")[1]])


def inverted(text):
    turn, shift = numbers(text, "R")[1], numbers(text, "T")[1]
    back = [turn[3 * column + row] for row in range(3) for column in range(3)]
    text = put(text, "T", [-sum(back[3 * row + i] * shift[i] for i in range(3)) for row in range(3)])
    return put(text, "R", back)


def configuration(folder, change=None):
    text = (SCENE / "calibration.yml").read_text(encoding="utf-8")
    (folder / "calibration.yml").write_text(change(text) if change else text, encoding="utf-8")
    told = CONFIGURATION.format(scene=SCENE, camera_path=SCENE / "frame.png", camera="", server="")
    return told.replace(f"{SCENE}/calibration.yml", f"{folder}/calibration.yml")


class Implausible(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")  # pylint: disable=consider-using-with
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def check(self, change, option="--check"):
        file = self.folder / "slsd.toml"
        file.write_text(configuration(self.folder, change), encoding="utf-8")
        return slsd(option, "--config", file).stdout

    def test_check_names_what_a_calibration_looks_like(self):
        for change in (metres, inverted):
            with self.subTest(change.__name__):
                self.assertRegex(self.check(change), f"(?m)^warning .*{ADVICE[change.__name__]}")
        self.assertIn(ADVICE["metres"], self.check(metres, "--check-config"))

    def test_lengths_of_another_unit_take_no_longer(self):
        """Symbols of thousands of pixels follow from them, whose looks would take minutes to draw."""
        self.assertIn("T looks like micrometres", self.check(micrometres, "--check-config"))
        file = self.folder / "slsd.toml"
        file.write_text(configuration(self.folder) + "[decode]\ndepth_min_mm = 0.4\ndepth_max_mm = 2.5\n", encoding="utf-8")
        self.assertRegex(slsd("--check-config", "--config", file).stdout, r"(?m)^warning .*look like metres: multiply them by 1000")

    def test_check_is_content_with_a_sound_one(self):
        told = self.check(None)
        self.assertNotIn("looks like", told)
        self.assertRegex(told, r"(?m)^ok +camera \"camera\": its calibration fits the symbols of its first frame: \d{3,}")

    def test_check_says_once_that_there_is_none(self):
        file = self.folder / "slsd.toml"
        told = configuration(self.folder).replace("file = \"" + str(self.folder), "# \"")
        file.write_text(told, encoding="utf-8")
        lines = [line for line in slsd("--check", "--config", file).stdout.splitlines() if "calibration" in line]
        self.assertEqual(lines, ["error    no calibration: calibrate, or set [calibration] file"])

    def test_empty_clouds_say_why_everywhere(self):
        for change in (metres, inverted):
            with self.subTest(change.__name__), \
                 Service(configuration=configuration(self.folder, change)) as service, service.client() as client:
                advice = ADVICE[change.__name__]
                for density in ("symbols", "pixels"):
                    scan, _ = client.call("scan", density=density, timeout_ms=600000)
                    self.assertEqual(scan["points"], 0)
                    self.assertIn(advice, scan["empty"])
                self.assertIn(advice, client.call("status")[0]["scans"]["empty"])
                done = slsctl("--socket", service.socket, "scan")
                self.assertRegex(done.stdout, f"(?m)^no points: .*{advice}")
                self.assertIn(advice, slsctl("--socket", service.socket, "status").stdout)
                self.assertIn(advice, json.loads(slsctl("--socket", service.socket, "--json", "scan").stdout)["empty"])
                self.assertIn(f"no points: camera \"camera\": ", service.log_text())
                self.assertEqual(service.log_text().count(": no points: "), 1)
                self.assertRegex(slsd("--check", "--config", service.file).stdout,
                                 f"(?m)^warning  the last scan gave no points: .*{advice}")

    def test_clouds_with_points_say_nothing(self):
        with Service() as service, service.client() as client:
            self.assertNotIn("empty", client.call("scan")[0])
            self.assertIsNone(client.call("status")[0]["scans"]["empty"])

    def test_start_warns(self):
        with Service(configuration=configuration(self.folder, metres)) as service:
            wait_until(lambda: ADVICE["metres"] in service.log_text(), "the warning")

    def test_frames_without_a_pattern_say_so(self):
        with Service(camera_path=SCENE / "black.png") as service, service.client() as client:
            self.assertIn("no symbol of the pattern was decoded", client.call("scan")[0]["empty"])


if __name__ == "__main__":
    unittest.main()
