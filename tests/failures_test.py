#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What failures.py prints of a run's results."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

RESULTS = """<?xml version="1.0" encoding="UTF-8"?>
<testsuite>
  <testcase name="a.good" status="run"><system-out>fine</system-out></testcase>
  <testcase name="a.skipped" status="notrun"><skipped message=""/><system-out>no camera</system-out></testcase>
  <testcase name="a.bad" status="fail"><failure message="Failed"/><system-out>{output}</system-out></testcase>
</testsuite>
"""


class Failures(unittest.TestCase):
    def run_on(self, output):
        with tempfile.TemporaryDirectory() as folder:
            results = pathlib.Path(folder, "tests.xml")
            results.write_text(RESULTS.format(output=output), encoding="utf-8")
            return subprocess.run([sys.executable, pathlib.Path(__file__).with_name("failures.py"), results],
                                  capture_output=True, text=True, check=True).stdout

    def test_prints_what_the_failed_test_printed(self):
        self.assertEqual(self.run_on("begin\nAssertionError: 1 &lt; 0"),
                         "\na.bad failed; the last 2 lines of 2:\n  begin\n  AssertionError: 1 < 0\n")

    def test_prints_the_end_of_a_long_output(self):
        told = self.run_on("\n".join(map(str, range(1000)))).splitlines()
        self.assertEqual(told[1], "a.bad failed; the last 60 lines of 1000:")
        self.assertEqual((told[2], told[-1]), ("  940", "  999"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
