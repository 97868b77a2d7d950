#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Counts the tests that skipped, and where CI=true fails for those that tests/skips.txt does not list.

usage: skips.py RESULTS.xml [LIST]     RESULTS.xml as `ctest --output-junit` writes it
"""
import fnmatch
import os
import re
import sys
import xml.etree.ElementTree
from pathlib import Path

# A case of Python's unittest, with its docstring's line where it has one; ctest sees only the program that holds it.
CASE = re.compile(r"^(\w+) \((?:__main__\.)?([\w.]+)\)(?:\n.*)? \.\.\. skipped ['\"](.*)['\"]$", re.MULTILINE)
# "file.cpp:82: Skipped", and what GTEST_SKIP() was told on the next line.
GTEST = re.compile(r": Skipped\n(.+)$", re.MULTILINE)


def skipped_in(results):
    """Name and reason of each test that skipped."""
    skipped = []
    for test in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        name, output = test.get("name"), test.findtext("system-out") or ""
        if test.find("skipped") is not None and test.get("status") != "disabled":
            told = GTEST.search(output)
            last = output.strip().splitlines()[-1:]
            skipped.append((name, told.group(1) if told else "".join(last) or "no reason given"))
        for case, holder, reason in CASE.findall(output):
            holder = holder.removesuffix("." + case)  # Python 3.11 says it twice
            skipped.append((f"{name}.{holder}.{case}", reason))
    return skipped


def read_list(path):
    """Patterns of names, each with the reason why it may skip."""
    listed = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        pattern, _, reason = line.partition("  ")
        if not reason.strip():
            sys.exit(f"{path}:{number}: a name pattern, two spaces and the reason are expected")
        listed.append(pattern)
    return listed


def main():
    results, *rest = sys.argv[1:]
    listed = read_list(Path(rest[0]) if rest else Path(__file__).with_name("skips.txt"))
    skipped = skipped_in(results)
    unlisted = [each for each in skipped if not any(fnmatch.fnmatchcase(each[0], pattern) for pattern in listed)]
    print(f"{len(skipped)} tests skipped" + (":" if skipped else ""))
    for name, reason in skipped:
        print(f"  {name}: {reason}" + (" (not in tests/skips.txt)" if (name, reason) in unlisted else ""))
    if unlisted and os.environ.get("CI") == "true":
        sys.exit(f"{len(unlisted)} of them may not skip here: make them run, or list them with the reason in tests/skips.txt")


if __name__ == "__main__":
    main()
