#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The examples of clients/python, run on a recorded frame."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "clients/python"
sys.path[:0] = [str(PACKAGE), str(PACKAGE / "examples"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import slsd  # noqa: E402
import turn_table  # noqa: E402
from service import Service  # noqa: E402


def there(module):
    return importlib.util.find_spec(module) is not None


class Examples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.service.wait_ready()
        with slsd.Scanner(cls.service.socket) as scanner:
            cls.points = scanner.scan(timeout_s=60).points
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)

    def run_example(self, name, *arguments, text=""):
        done = subprocess.run([sys.executable, PACKAGE / "examples" / name, *map(str, arguments)], input=text, text=True,
                              capture_output=True, timeout=120, check=False,
                              env={**os.environ, "SLSD_SOCKET": str(self.service.socket), "PYTHONPATH": str(PACKAGE),
                                   "MPLBACKEND": "agg"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def test_conveyor_scans_every_part(self):
        said = self.run_example("conveyor.py", self.folder, text="\n\n\n")
        self.assertEqual(len(said.splitlines()), 3)
        for part in range(3):
            np.testing.assert_array_equal(np.load(self.folder / f"part-{part:06}.npy"), self.points)

    def test_turn_table_takes_its_views(self):
        self.run_example("turn_table.py", self.folder / "all.npy", 2, text="\n\n")
        cloud = np.load(self.folder / "all.npy")
        first = np.stack([self.points[axis] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(cloud[:len(first)], first, atol=1e-4)
        np.testing.assert_allclose(cloud[len(first):, 0], -first[:, 0], atol=1e-3)  # by half a turn about the y axis
        np.testing.assert_allclose(cloud[len(first):, 2], 2000 - first[:, 2], atol=1e-3)

    def test_to_open3d_writes_the_cloud(self):
        if not there("open3d"):
            self.skipTest("Open3D is not installed (pip install open3d)")
        self.assertIn("points", self.run_example("to_open3d.py", self.folder / "cloud.ply"))

    def test_live_view_has_ten_lines(self):
        text = (PACKAGE / "examples/live_view.py").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if line and not line.startswith("#")]
        self.assertLessEqual(len(lines), 10)
        compile(text, "live_view.py", "exec")


class TurnTable(unittest.TestCase):
    def test_views_meet_in_one_frame(self):
        draw = np.random.default_rng(3)
        point, axis = np.array([12.0, -30, 950]), np.array([0.1, 0.97, -0.2])
        part = point + draw.normal(0, 60, (500, 3))
        views = [turn_table.turned(part, i * 2 * np.pi / 8, point, axis) for i in range(8)]
        centres = [view[0] + draw.normal(0, 0.02, 3) for view in views]  # of the sphere, as a scan measures it
        found_point, found_axis = turn_table.axis_of(centres)
        found_axis = found_axis * np.sign(found_axis @ axis)
        merged = turn_table.merged(views, found_point, found_axis).reshape(8, -1, 3)
        self.assertLess(np.sqrt(((merged - part)**2).sum(axis=2).mean()), 0.2)  # mm

    def test_centres_on_a_line_are_no_axis(self):
        with self.assertRaisesRegex(ValueError, "on a line"):
            turn_table.axis_of([[0, 0, 900], [1, 0, 900], [2, 0, 900]])


if __name__ == "__main__":
    unittest.main()
