#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What `cmake --install` puts where: install_test.py CMAKE BUILD_DIR."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD = sys.argv[1:3]


def install(prefix, destination):
    subprocess.run([CMAKE, "--install", BUILD, "--prefix", prefix], check=True, capture_output=True,
                   env={"DESTDIR": destination, "PATH": "/usr/bin:/bin"})


class Install(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name)

    def test_puts_everything_in_its_place(self):
        install("/usr", str(self.root))
        for file in ("usr/bin/slsd", "usr/bin/slsctl", "usr/lib/systemd/system/slsd.service",
                     "usr/lib/systemd/system/slsd-display.service", "etc/slsd/slsd.toml",
                     "etc/slsd/patterns/16px-5.toml",
                     "usr/share/slsd/boards/charuco-11x7-23mm-a4.pdf", "usr/share/man/man1/slsctl.1", "usr/share/man/man5/slsd.toml.5",
                     "usr/share/man/man8/slsd.8"):
            self.assertTrue((self.root / file).is_file(), file)
        unit = (self.root / "usr/lib/systemd/system/slsd.service").read_text(encoding="utf-8")
        self.assertIn("ExecStart=/usr/bin/slsd --config /etc/slsd/slsd.toml\n", unit)

    def test_units_are_sound(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("no systemd-analyze here (package systemd)")
        install("/usr", str(self.root))
        for program in ("usr/lib/xorg/Xorg", "bin/kill", "bin/sh"):
            (self.root / program).parent.mkdir(parents=True, exist_ok=True)
            (self.root / program).write_text("#!/bin/sh\n", encoding="utf-8")
            (self.root / program).chmod(0o755)
        for target in ("sysinit", "basic", "shutdown", "multi-user"):  # systemd's own, which every unit needs
            (self.root / f"usr/lib/systemd/system/{target}.target").write_text("[Unit]\n", encoding="utf-8")
        verified = subprocess.run(["systemd-analyze", "verify", "--man=no", f"--root={self.root}", "slsd-display.service",
                                   "slsd.service"], capture_output=True, text=True, check=False)
        self.assertEqual((verified.stderr, verified.returncode), ("", 0))

    def test_follows_the_prefix(self):
        install("/opt/scanner", str(self.root))
        unit = (self.root / "opt/scanner/lib/systemd/system/slsd.service").read_text(encoding="utf-8")
        self.assertIn("ExecStart=/opt/scanner/bin/slsd --config /opt/scanner/etc/slsd/slsd.toml\n", unit)

    def test_leaves_the_administrators_configuration_alone(self):
        file = self.root / "etc/slsd/slsd.toml"
        file.parent.mkdir(parents=True)
        file.write_text("# mine\n", encoding="utf-8")
        install("/usr", str(self.root))
        self.assertEqual(file.read_text(encoding="utf-8"), "# mine\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
