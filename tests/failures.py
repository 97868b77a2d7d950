#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Prints the end of what each failed test printed.

usage: failures.py RESULTS.xml     RESULTS.xml as `ctest --output-junit` writes it
"""
import sys
import xml.etree.ElementTree

LINES = 60


def failed_in(results):
    """Name and output of each test that failed."""
    for test in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        if test.find("failure") is not None or test.get("status") == "fail":
            yield test.get("name"), test.findtext("system-out") or ""


def main():
    for name, output in failed_in(sys.argv[1]):
        lines = output.strip().splitlines()
        print(f"\n{name} failed; the last {min(LINES, len(lines))} lines of {len(lines)}:")
        print("\n".join("  " + line for line in lines[-LINES:]))


if __name__ == "__main__":
    main()
