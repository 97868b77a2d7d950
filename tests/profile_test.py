#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Tests ./run profile's parts: profile_test.py SLSD_PROFILE SOURCE_DIR"""
import re
import subprocess
import sys
import unittest
import xml.etree.ElementTree as xml

PROGRAM, SOURCES = sys.argv[1:3]
SVG = "{http://www.w3.org/2000/svg}"


def flame_graph(text):
    return subprocess.run([f"{SOURCES}/bench/flame_graph.py"], input=text, capture_output=True, text=True, check=False)


class Profile(unittest.TestCase):
    def test_a_frame_gives_a_row_for_each_stage(self):
        out = subprocess.run([PROGRAM, f"{SOURCES}/tests/corpus/8px-6-dense-step-bright/frame.png", "--repeat", "2"],
                             capture_output=True, text=True, check=True).stdout
        rows = {line.split()[0]: line.split()[1:] for line in out.splitlines()}
        stages = ("binarize", "find_regions", "decode_windows", "review", "find_blur", "grow", "search", "fuse", "judge", "clean")
        for stage in (*stages, "decode", "dense", "whole", "anchor"):
            self.assertGreater(float(rows[stage][0]), 0, stage)
        self.assertAlmostEqual(float(rows["anchor"][2]), 1)
        self.assertGreater(int(re.search(r"^(\d+) points", out, re.M)[1]), 100000)
        self.assertLessEqual(sum(float(rows[stage][0]) for stage in stages), float(rows["whole"][0]) + 0.1)

    def test_two_cores_give_the_same_points(self):
        points = []
        for cores in ("1", "2"):
            out = subprocess.run([PROGRAM, f"{SOURCES}/tests/corpus/8px-6-dense-step-bright/frame.png", "--repeat", "1",
                                  "--no-anchor", "--cores", cores], capture_output=True, text=True, check=True).stdout
            points.append(re.search(r"^(\d+) points", out, re.M)[1])
            self.assertIn("one core;" if cores == "1" else "2 cores;", out)
        self.assertEqual(points[0], points[1])

    def test_a_missing_calibration_is_named(self):
        run = subprocess.run([PROGRAM, f"{SOURCES}/tests/corpus/8px-6-dense-step-bright/frame.png", "--calibration",
                              "none.yml"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn("none.yml", run.stderr)

    def test_boxes_are_as_wide_as_their_share(self):
        stack = ["        1 slsd::Cloned<&slsd::(anonymous namespace)::fuse_lanes>::avx2_fma(slsd::Fusing const&)",
                 "        2 slsd::SurfaceGrid::fuse(slsd::Executor&)", "        3 main"]
        text = "\n".join(stack) + "\n\n" + "\n".join(stack[1:]) + "\n\n" + "\n".join(stack[2:]) + "\n\n" + stack[2] + "\n"
        root = xml.fromstring(flame_graph(text).stdout)
        widths = {group.find(f"{SVG}title").text: float(group.find(f"{SVG}rect").get("width"))
                  for group in root.iter(f"{SVG}g")}
        self.assertEqual(set(widths), {"main: 100.0 %", "SurfaceGrid::fuse: 50.0 %", "fuse_lanes [avx2_fma]: 25.0 %"})
        self.assertAlmostEqual(widths["SurfaceGrid::fuse: 50.0 %"], widths["main: 100.0 %"] / 2, delta=0.1)
        self.assertAlmostEqual(widths["fuse_lanes [avx2_fma]: 25.0 %"], widths["main: 100.0 %"] / 4, delta=0.1)

    def test_no_samples_are_an_error(self):
        run = flame_graph("")
        self.assertEqual(run.returncode, 1)
        self.assertIn("no samples", run.stderr)


unittest.main(argv=sys.argv[:1])
