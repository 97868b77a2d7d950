#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Each test is labelled with the folder of its room below tests/, by which `./run test ROOM` chooses it."""
import json
import pathlib
import subprocess
import sys
import unittest

TESTS = pathlib.Path(__file__).resolve().parent
CTEST, BUILD = sys.argv[1:3]


def run(*arguments):
    return subprocess.run(arguments, capture_output=True, text=True, check=False, timeout=600)


def labels_of(test):
    return next((each["value"] for each in test["properties"] if each["name"] == "LABELS"), [])


class Labels(unittest.TestCase):
    def test_each_test_has_the_folder_of_its_room(self):
        tests = json.loads(run(CTEST, "--test-dir", BUILD, "--show-only=json-v1").stdout)["tests"]
        self.assertGreater(len(tests), 0)
        of_all = ("tests.", "bench.")  # of no room
        without = [test["name"] for test in tests
                   if not test["name"].startswith(of_all) and not test["name"].endswith("_NOT_BUILT")
                   and not [label for label in labels_of(test) if (TESTS / label / "CMakeLists.txt").exists()]]
        self.assertEqual(without, [])

    def test_refuses_what_is_no_room(self):
        for room, message in (("core/nowhere", "there is no room core/nowhere"), ("man", "there are no tests of man")):
            with self.subTest(room=room):
                done = run(TESTS.parent / "run", "test", room)
                self.assertEqual(done.returncode, 1)
                self.assertIn(message, done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
