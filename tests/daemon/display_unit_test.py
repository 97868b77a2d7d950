#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The X server of slsd-display.service, with the unit's options, on the dummy driver in the place of a graphics card."""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

from x_server import CONFIGURATION, XORG, can_start

UNIT = pathlib.Path(__file__).parents[2] / "systemd" / "slsd-display.service"
CANNOT_START = 77
AS_NOBODY = ("setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups", "--no-new-privs", "--bounding-set=-all",
             "--inh-caps=-all")


AUTH = "/run/slsd-display/auth"


def line_of(key):
    return re.search(rf"^{key}=(.*)$", UNIT.read_text(encoding="utf-8"), re.MULTILINE).group(1)


class DisplayUnit(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.folder.chmod(0o755)
        (self.folder / "xorg.conf").write_text(CONFIGURATION, encoding="utf-8")
        self.auth = self.folder / "auth"
        # Read by systemd as a shell reads it but for the escapes, of which it takes a level in any quotes.
        make_key = self.in_folder(line_of("ExecStartPre")).removeprefix("+").replace("\\\\", "\\")
        self.assertIn("chown slsd ", make_key)  # a user that may be missing here
        subprocess.run(shlex.split(make_key.replace("chown slsd ", f"chown {os.getuid()} ")), check=True)

    def in_folder(self, line):
        self.assertIn(AUTH, line)
        return line.replace(AUTH, str(self.auth))

    def command(self):
        """The unit's, without its display and its virtual terminal."""
        words = self.in_folder(line_of("ExecStart")).split()
        self.assertEqual(words[:3], [XORG, ":0", "vt7"])
        return words[3:]

    def start(self, *before):
        arguments = ["-config", str(self.folder / "xorg.conf"), "-configdir", str(self.folder / "none"), "-displayfd", "1"]
        server = subprocess.Popen([*before, XORG, *self.command(), *arguments], stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(lambda: (server.kill(), server.wait(), server.stdout.close()))
        number = server.stdout.readline().strip()
        self.assertTrue(number, "the X server does not start")
        return ":" + number

    def ask(self, display, *arguments, key=None):
        return subprocess.run(arguments, env={**os.environ, "DISPLAY": display, "XAUTHORITY": str(key or self.auth)}, check=True,
                              capture_output=True, text=True).stdout

    def test_starts_and_keeps_the_screen_lit(self):
        display = self.start()
        self.assertIn("DUMMY0 connected", self.ask(display, "xrandr"))
        self.assertRegex(self.ask(display, "xset", "q"), r"timeout:\s+0\s")

    def test_lets_only_those_in_who_have_the_key(self):
        display = self.start()
        self.assertEqual(len(self.auth.read_bytes()), 44)
        self.assertEqual(self.auth.stat().st_mode & 0o777, 0o600)
        with self.assertRaises(subprocess.CalledProcessError):
            self.ask(display, "xrandr", key=self.folder / "none")

    @unittest.skipUnless(os.geteuid() == 0 and shutil.which("setpriv"), "only root can become somebody else")
    def test_needs_no_privilege_where_no_card_asks_for_one(self):
        self.assertIn("DUMMY0 connected", self.ask(self.start(*AS_NOBODY), "xrandr"))


if __name__ == "__main__":
    if not can_start():
        sys.exit(CANNOT_START)
    unittest.main(verbosity=2)
