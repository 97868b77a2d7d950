#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""How much of what slsd-dds sends arrives at a node of ROS 2 (rclpy, its default middleware and this host's sockets).

    SLSD_BIN=build/release/bin SLSD_SCENE=build/release/tests/daemon/scene tests/clients/ros_load.py

SLSD_ROS_PYTHON names an interpreter with rclpy, as for ros_test.py.
"""
import argparse
import pathlib

from ros_test import node, shown
from seam import CELL, service

CASES = {"symbols": (["--rate", "10", "--image-rate", "2"], ["points", "camera_info", "image", "compressed"]),
         "pixels": (["--rate", "2", "--density", "pixels"], ["points", "camera_info", "depth", "depth_info"])}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--calls", type=int, default=200, help="of the trigger")
    parser.add_argument("more", nargs="*", help="options for slsd-dds, after --")
    given = parser.parse_args()
    rmem_max = pathlib.Path("/proc/sys/net/core/rmem_max").read_text(encoding="utf-8").strip()
    print(f"net.core.rmem_max {rmem_max}, {given.seconds:g} s each; received of sent:")
    with service(CELL, "left", "scene") as scanner:
        for density, (options, topics) in CASES.items():
            for quality in ("best effort", "reliable"):
                with shown(scanner, *options, *given.more):
                    seen = node("--measure", str(given.seconds), "--topics", *topics, *(["--reliable"] if quality == "reliable" else []))
                arrived = (f"{topic} {seen['counts'][topic]} of {seen['sent'][topic]}" for topic in [*topics, "diagnostics"])
                print(f"{density}, {quality}: {', '.join(arrived)}", flush=True)
        with shown(scanner, "--rate", "10"):
            seen = node("--calls", str(given.calls))
        answered = sum(answer is not None and answer[0] for answer in seen["answers"])
        ours = sum(name == "slsd" for name, _ in seen["nodes"])
        print(f"{answered} of {given.calls} triggers in {seen['seconds']:.1f} s; {ours} node of slsd")


if __name__ == "__main__":
    main()
