#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Rooms of core configure without the packages that only other rooms need: alone_test.py CMAKE COMPILER"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
CMAKE, COMPILER = sys.argv[1:3]
OF_OTHER_ROOMS = ("Boost", "CLI11", "Ceres", "CycloneDDS", "JPEG", "PNG", "TIFF", "benchmark", "fastrtps", "nlohmann_json",
                  "spdlog")


def pkg_config_file(name):
    folder = subprocess.run(("pkg-config", "--variable=pcfiledir", name), capture_output=True, text=True, check=True).stdout
    return pathlib.Path(folder.strip()) / f"{name}.pc"


class Alone(unittest.TestCase):
    def configure(self, *rooms, without=(), pkg=None):
        """@param pkg the one package that pkg-config finds
        @return the finished process, and the parts of OpenCV that it found"""
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as temporary:
            build = pathlib.Path(temporary) / "build"
            if pkg:
                (pathlib.Path(temporary) / f"{pkg}.pc").symlink_to(pkg_config_file(pkg))
            done = subprocess.run(
                (CMAKE, "-G", "Ninja", "-S", SOURCE, "-B", build, f"-DSLSD_ROOMS={';'.join(rooms)}",
                 f"-DCMAKE_CXX_COMPILER={COMPILER}", *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in without)),
                env={**os.environ, "PKG_CONFIG_LIBDIR": temporary}, capture_output=True, text=True, check=False, timeout=120)
            cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
        return done, set(re.findall(r"^OPENCV_(\w+)_LIBRARY:FILEPATH=/", cache, re.M))

    def assert_configures(self, *rooms, without, opencv=frozenset(), pkg=None):
        done, parts = self.configure(*rooms, without=without, pkg=pkg)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        if "calib3d" in parts:  # geometry is compared with it if it is there
            parts -= {"calib3d", "core"} - opencv
        self.assertEqual(parts, opencv)

    def test_geometry_needs_eigen_fmt_and_expected(self):
        self.assert_configures("core/geometry", without=("tomlplusplus", *OF_OTHER_ROOMS))

    def test_calibration_files_need_yaml(self):
        self.assert_configures("core/calibration_file", without=("tomlplusplus", *OF_OTHER_ROOMS), opencv={"core"}, pkg="yaml-0.1")

    def test_scanning_needs_tomlplusplus_and_imgproc(self):
        self.assert_configures("core/text", "core/code", "core/cloud", "core/decode", "core/dense", "picture",
                               without=OF_OTHER_ROOMS, opencv={"core", "imgproc"})

    def test_calibrating_needs_more(self):
        done, _ = self.configure("core/board", without=OF_OTHER_ROOMS)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("Ceres", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
