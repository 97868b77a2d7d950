#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Comments, pages and commits are worded as tests/wording.py asks, and it finds what is not."""
import unittest

import wording


class Wording(unittest.TestCase):
    def test_of_this_checkout_has_no_new_faults(self):
        if not wording.git("rev-parse", "HEAD"):
            self.skipTest("no checkout: sources are listed by git")
        self.assertEqual(wording.check(), [])

    def test_finds_doc_comments_that_start_with_a_clause(self):
        source = "/// What lies around.\n/// How it goes on.\nint a;\n/// The place.\nint b;  ///< of a\n  /// Of c.\n"
        self.assertEqual(list(wording.clause_openings(source)), [(1, "What lies around."), (6, "Of c.")])
        self.assertEqual(list(wording.clause_openings("/// Forms a line.\n// What else\n/// Ofen\n")), [])

    def test_finds_long_sentences_wherever_they_stand(self):
        long = " ".join(["word"] * 41)
        for page in (f"# Title\n{long}.\n", f"- item\n- {long}\n", f"| a | b |\n|---|---|\n| c | {long} |\n",
                     f"Short. {long.capitalize()}.\n"):
            with self.subTest(page=page[:20]):
                self.assertEqual(len(wording.long_sentences(page)), 1)
        half = " ".join(["word"] * 21)
        for page in (f"{half}. {half.capitalize()}.\n", f"- {half}\n- {half}\n", f"| {half} | {half} |\n",
                     f"```\n{long}\n```\n", f"Code:\n\n    {long}\n", f"{half}\n\n{half}\n"):
            with self.subTest(page=page[:20]):
                self.assertEqual(wording.long_sentences(page), [])

    def test_finds_bad_subjects(self):
        for subject in ("core/decode: reject a", "README, docs: say it", "tests/*.py: check it", "run: build one room"):
            self.assertIsNone(wording.bad_subject(subject), subject)
        for subject in ("Fix it", "core: end it.", "core/decode: " + "x" * 70):
            self.assertIsNotNone(wording.bad_subject(subject), subject)

    def test_lets_the_list_only_shrink(self):
        found = {"core": ["a", "b"]}
        self.assertEqual(wording.compare(found, {"core": 2}), [])
        self.assertEqual(len(wording.compare(found, {"core": 1})), 3)
        self.assertIn("lower its number", wording.compare(found, {"core": 3})[0])
        self.assertIn("lower its number", wording.compare({}, {"core": 1})[0])


if __name__ == "__main__":
    unittest.main()
