#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The service and the program that calibrates are two: what the service is linked with, and how the one starts the other."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

BIN = pathlib.Path(os.environ["SLSD_BIN"])
OF_CALIBRATING = r"ceres|glog|cholmod|cxsparse|suitesparse|aruco|calib3d|features2d|structured_light|opencv|lapack|blas|cairo"


class Programs(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name)

    def put(self, program, place):
        (self.root / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(BIN / program, self.root / place)
        return self.root / place

    def print_board(self, slsd):
        return subprocess.run([slsd, "--print-board", self.root / "board.svg"], capture_output=True, text=True,
                              check=False, timeout=600)

    def test_the_service_is_linked_with_nothing_that_only_calibrating_needs(self):
        loaded = subprocess.run(["ldd", BIN / "slsd"], capture_output=True, text=True, check=True).stdout
        names = [line.split()[0] for line in loaded.splitlines()]
        self.assertGreater(len(names), 10)
        self.assertEqual([name for name in names if re.search(OF_CALIBRATING, name)], [])
        self.assertLessEqual(len(names), 60)

    def test_what_decodes_a_strangers_picture_is_linked_with_nothing_else(self):
        loaded = subprocess.run(["ldd", BIN / "slsd-picture"], capture_output=True, text=True, check=True).stdout
        names = {re.split(r"(?:16)?\.so", pathlib.Path(line.split()[0]).name)[0] for line in loaded.splitlines()}
        allowed = {"linux-vdso", "ld-linux-x86-64", "ld-linux-aarch64", "libpng", "libz", "libstdc++", "libgcc_s", "libc", "libm",
                   "libseccomp"}
        if not os.environ.get("SLSD_SANITIZE"):
            self.assertEqual(names - allowed, set())

    def test_what_decodes_pictures_takes_nothing_but_a_size(self):
        for arguments in ([], ["1", "x"], ["0", "5"], ["1", "99999999"], ["1", "1", "1"]):
            done = subprocess.run([BIN / "slsd-picture", *arguments], capture_output=True, check=False, timeout=600, stdin=subprocess.DEVNULL)
            self.assertEqual((done.returncode, done.stdout), (2, b""), arguments)

    def test_it_is_found_beside_the_service(self):
        slsd = self.put("slsd", "build/slsd")
        self.put("slsd-calibrate", "build/slsd-calibrate")
        self.assertEqual(self.print_board(slsd).returncode, 0)
        self.assertTrue((self.root / "board.svg").is_file())

    def test_it_is_found_where_it_is_installed(self):
        slsd = self.put("slsd", "usr/bin/slsd")
        self.put("slsd-calibrate", "usr/libexec/slsd/slsd-calibrate")
        self.assertEqual(self.print_board(slsd).returncode, 0)

    def test_it_is_found_through_a_link(self):
        slsd = self.put("slsd", "opt/bin/slsd")
        self.put("slsd-calibrate", "opt/libexec/slsd/slsd-calibrate")
        (self.root / "slsd").symlink_to(slsd)
        self.assertEqual(self.print_board(self.root / "slsd").returncode, 0)

    def test_where_it_is_not_installed_its_package_is_named(self):
        done = self.print_board(self.put("slsd", "usr/bin/slsd"))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^slsd: \S*libexec/slsd/slsd-calibrate: .*install the package slsd-calibrate\n$")

    def test_where_hand_eye_is_not_installed_its_package_is_named(self):
        slsctl = self.put("slsctl", "usr/bin/slsctl")
        done = subprocess.run([slsctl, "hand-eye", "--mounted", "arm", "--poses", "ur", "--from", self.root], capture_output=True,
                              text=True, check=False, timeout=600)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^slsctl: \S*libexec/slsd/slsd-hand-eye: .*install the package slsd-calibrate\n$")

    def test_hand_eye_is_carried_out_by_its_program(self):
        slsctl = self.put("slsctl", "usr/bin/slsctl")
        self.put("slsd-hand-eye", "usr/libexec/slsd/slsd-hand-eye")
        for words in ((), ("--json",)):
            done = subprocess.run([slsctl, *words, "hand-eye", "--mounted", "arm", "--poses", "ur", "--from", self.root,
                                   "--config", self.root / "none.toml"], capture_output=True, text=True, check=False, timeout=600)
            self.assertEqual(done.returncode, 1)
            if words:
                self.assertIn("none.toml", json.loads(done.stdout)["error"]["message"])
            else:
                self.assertRegex(done.stderr, r"^slsctl: \S*none.toml: ")
        self.assertEqual(list(self.root.glob("*.yml")), [])

    def test_hand_eye_asks_for_what_it_needs(self):
        for words, reason in (((), "--mounted"), (("--mounted", "desk"), "desk"), (("--mounted", "arm", "--poses", "kukaa"), "kuka")):
            done = subprocess.run([BIN / "slsctl", "hand-eye", *words], capture_output=True, text=True, check=False, timeout=600)
            self.assertEqual(done.returncode, 2)
            self.assertIn(reason, done.stderr)

    def test_one_that_does_not_start_is_named(self):
        slsd = self.put("slsd", "usr/bin/slsd")
        self.put("slsd-calibrate", "usr/libexec/slsd/slsd-calibrate").chmod(0o644)
        done = self.print_board(slsd)
        self.assertEqual(done.returncode, 1)
        self.assertIn("does not start: Permission denied", done.stderr)

    def test_it_serves_nobody(self):
        done = subprocess.run([BIN / "slsd-calibrate"], capture_output=True, text=True, check=False, timeout=600)
        self.assertEqual(done.returncode, 2)
        self.assertIn("slsd is the service", done.stderr)

    def test_both_take_the_same_command_line(self):
        texts = [subprocess.run([BIN / program, "--calibrate", "--help"], capture_output=True, text=True, check=True).stdout
                 for program in ("slsd", "slsd-calibrate")]
        self.assertEqual(texts[0].replace(str(BIN / "slsd"), ""), texts[1].replace(str(BIN / "slsd-calibrate"), ""))


if __name__ == "__main__":
    unittest.main(verbosity=2)
