#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Prints the medians of a file that slsd-bench wrote, in processor time, and their ratios to floor and anchor; what runs
on all cores in the time of the clock, and by the anchor on all cores."""
import json
import statistics
import sys


def medians(path):
    times = {}
    with open(path, encoding="utf-8") as file:
        for run in json.load(file)["benchmarks"]:
            if run["run_type"] == "iteration" and not run.get("error_occurred"):
                # A stage's time is part of an iteration, and measured by hand.
                clock = "real_time" if run["name"].startswith("stage/") or "all_cores" in run["name"] else "cpu_time"
                times.setdefault(run["name"], []).append(run[clock])
    return {name: statistics.median(values) for name, values in times.items()}


def ratio(ms, other_ms):
    return f"{ms / other_ms:10.3f}" if other_ms else f"{'':10}"


def main():
    ms = medians(sys.argv[1])
    floor = ms.get("floor/1600x1200")
    print(f"{'benchmark':40}{'median ms':>10}{'/ floor':>10}{'/ anchor':>10}")
    for name, value in sorted(ms.items()):
        cores = "all_cores_" if "all_cores" in name else ""
        anchor = ms.get(f"opencv_anchor/{cores}1600x1200_" + name.rsplit("_", 1)[-1])
        print(f"{name:40}{value:10.3f}{ratio(value, floor)}{ratio(value, anchor)}")


main()
