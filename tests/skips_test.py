#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Who skipped, from what ctest writes, and whether CI lets it pass."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

RESULTS = """<testsuite>
<testcase name="a.code" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/>
<system-out>no X server starts here
</system-out></testcase>
<testcase name="Suite.Case/Param" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>[ RUN      ] Suite.Case/Param
file.cpp:82: Skipped
root may read everything
[  SKIPPED ] Suite.Case/Param (0 ms)
</system-out></testcase>
<testcase name="daemon.py" status="run"><system-out>test_a (__main__.C.test_a) ... skipped 'permitted to root'
test_b (__main__.C.test_b)
What it is. ... skipped 'no tool'
test_c (__main__.C.test_c) ... ok
</system-out></testcase>
<testcase name="fine" status="run"><system-out></system-out></testcase>
</testsuite>
"""


class Skips(unittest.TestCase):
    def run_on(self, listed, ci):
        with tempfile.TemporaryDirectory() as folder:
            results, names = pathlib.Path(folder, "tests.xml"), pathlib.Path(folder, "skips.txt")
            results.write_text(RESULTS, encoding="utf-8")
            names.write_text(listed, encoding="utf-8")
            return subprocess.run([sys.executable, pathlib.Path(__file__).with_name("skips.py"), results, names],
                                  capture_output=True, text=True, check=False, env={**os.environ, "CI": ci})

    def test_names_each_with_its_reason(self):
        done = self.run_on("", "")
        self.assertEqual(done.returncode, 0)
        self.assertTrue(done.stdout.startswith("4 tests skipped:\n"))
        for line in ("a.code: no X server starts here", "Suite.Case/Param: root may read everything",
                     "daemon.py.C.test_a: permitted to root", "daemon.py.C.test_b: no tool"):
            self.assertIn(f"  {line} (not in tests/skips.txt)\n", done.stdout)

    def test_fails_in_ci_for_one_that_is_not_listed(self):
        listed = "a.code  no display\nSuite.*/*  root\ndaemon.py.C.test_?  rights\n"
        self.assertEqual(self.run_on(listed, "true").returncode, 0)
        self.assertNotEqual(self.run_on(listed.replace("a.code", "b.code"), "true").returncode, 0)

    def test_wants_a_reason(self):
        self.assertIn("skips.txt:2", self.run_on("# a list\na.code\n", "").stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
