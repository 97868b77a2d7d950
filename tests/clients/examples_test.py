#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The examples of clients/python, run on recorded frames.

With SLSD_EXAMPLES_PYTHON, an interpreter that has numpy, open3d and matplotlib (pip install open3d-cpu matplotlib), those that need them run too.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "clients/python"
sys.path[:0] = [str(PACKAGE), str(PACKAGE / "examples"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import drift  # noqa: E402
import gap  # noqa: E402
import slsd  # noqa: E402
import turn_table  # noqa: E402
from seam import CELL, CONFIGURATION  # noqa: E402
from service import Service, wait_until  # noqa: E402

PYTHON = os.environ.get("SLSD_EXAMPLES_PYTHON", sys.executable)
RECORDED = HERE / "recorded"


def there(module):
    return subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True, check=False).returncode == 0


def recorded(folder):
    """The service of a recording, as its own configuration has it, on a socket of its own."""
    text = (folder / "slsd.toml").read_text(encoding="utf-8").replace("/tmp/slsd-example.sock", "slsd.sock")
    return Service(configuration=re.sub(r'^(file|path) = "([^"]*)"', lambda line: f'{line[1]} = "{(folder / line[2]).resolve()}"', text, flags=re.M))


def environment(service):
    return {**os.environ, "SLSD_SOCKET": str(service.socket), "PYTHONPATH": str(PACKAGE), "MPLBACKEND": "agg"}


def run_example(service, name, *arguments, text="", python=sys.executable, path=""):
    done = subprocess.run([python, PACKAGE / "examples" / name, *map(str, arguments)], input=text, text=True, capture_output=True,
                          timeout=240, check=False, env={**environment(service), "PYTHONPATH": f"{PACKAGE}:{path}"})
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout


# What libgpiod's package has of the same names, version 2.
GPIOD = """
import enum, sys, types
class Edge(enum.Enum): RISING = 2
line = types.SimpleNamespace(Edge=Edge)
class LineSettings:
    def __init__(self, edge_detection, debounce_period): assert edge_detection is Edge.RISING and debounce_period.microseconds == 5000
class Request:
    batches = [["part"], ["part", "part"]]
    def __enter__(self): return self
    def __exit__(self, *_): pass
    def read_edge_events(self):
        if not self.batches: raise KeyboardInterrupt
        return self.batches.pop(0)
def request_lines(path, config):
    assert path == "/dev/gpiochip0" and list(config) == [17]
    return Request()
"""


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

    def test_conveyor_scans_every_part(self):
        said = run_example(self.service, "conveyor.py", self.folder, text="\n\n\n")
        self.assertEqual(len(said.splitlines()), 3)
        for part in range(3):
            np.testing.assert_array_equal(np.load(self.folder / f"part-{part:06}.npy"), self.points)

    def test_conveyor_scans_by_a_gpio_line(self):
        folder = self.folder / "gpio"
        folder.mkdir()
        (folder / "gpiod.py").write_text(GPIOD, encoding="utf-8")
        done = subprocess.run([sys.executable, PACKAGE / "examples/conveyor.py", folder, "/dev/gpiochip0", "17"], capture_output=True,
                              text=True, timeout=600, check=False, env={**environment(self.service), "PYTHONPATH": f"{PACKAGE}:{folder}"})
        self.assertIn("KeyboardInterrupt", done.stderr)
        self.assertEqual([line.split(":")[0] for line in done.stdout.splitlines()], ["part 0", "part 1", "part 2"])
        self.assertEqual(len(list(folder.glob("part-*.npy"))), 3)

    def test_turn_table_takes_its_views(self):
        run_example(self.service, "turn_table.py", self.folder / "all.npy", 2, text="\n\n")
        cloud = np.load(self.folder / "all.npy")
        first = np.stack([self.points[axis] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(cloud[:len(first)], first, atol=1e-4)
        np.testing.assert_allclose(cloud[len(first):, 0], -first[:, 0], atol=1e-3)  # by half a turn about the y axis
        np.testing.assert_allclose(cloud[len(first):, 2], 2000 - first[:, 2], atol=1e-3)

    def test_to_open3d_writes_the_cloud(self):
        if not there("open3d"):
            self.skipTest("Open3D is not installed (pip install open3d)")
        said = run_example(self.service, "to_open3d.py", self.folder / "cloud.ply", python=PYTHON)
        self.assertGreater(int(said.split()[0]), 0.9 * len(self.points))

    def test_live_view_has_few_lines(self):
        text = (PACKAGE / "examples/live_view.py").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if line and not line.startswith("#")]
        self.assertLessEqual(len(lines), 15)
        compile(text, "live_view.py", "exec")

    def test_live_view_follows_the_clouds(self):
        if not there("matplotlib"):
            self.skipTest("matplotlib is not installed (apt install python3-matplotlib)")
        view = subprocess.Popen([PYTHON, PACKAGE / "examples/live_view.py"], env=environment(self.service), stderr=subprocess.DEVNULL)
        try:
            with slsd.Scanner(self.service.socket) as scanner:
                wait_until(lambda: scanner.status()["subscribers"] == 1, "the view")
                before = scanner.status()["scans"]["succeeded"]
                wait_until(lambda: scanner.status()["scans"]["succeeded"] > before + 5, "clouds")
            self.assertIsNone(view.poll())
        finally:
            view.kill()
            view.wait()


class Usage(unittest.TestCase):
    """What a program says that cannot do its work: one line says why, below how it is called."""

    RIGHT = {"conveyor.py": ["."], "drift.py": ["/tmp/none.csv", "1", "1"], "gap.py": ["-160,-110,240,230", "98,148,142,192"], "pick.py": ["80"],
             "turn_table.py": ["/tmp/none.npy", "2", "-1,0,2010", "0,-1,0"], "to_open3d.py": ["/tmp/none.ply"], "live_view.py": [], "print_part.py": ["/tmp/none.stl", "3"]}
    WRONG = {"conveyor.py": [[], ["/nonexistent"], [".", "/dev/gpiochip0"], [".", "/dev/gpiochip0", "x"]], "drift.py": [[], ["a.csv", "often"], ["a.csv", "1", "x"]],
             "gap.py": [[], ["1,2,3,4"], ["1,2,3", "1,2,3,4"], ["a", "b"], ["4,3,2,1", "1,2,3,4"], ["1,2,3,4", "1,2,3,4", "0"]],
             "pick.py": [["large"], ["0"], ["-5"], ["1", "2"]], "turn_table.py": [[], ["a.npy"], ["a.npy", "x"], ["a.npy", "0"], ["a.npy", "2", "1,2"], ["a.npy", "2", "1,2,3", "0,0,0"]],
             "to_open3d.py": [[], ["a.ply", "b"]], "print_part.py": [[], ["a.stl"], ["a.stl", "1"], ["a.stl", "x"], ["a.stl", "3", "--box", "1"]]}

    def said(self, name, words):
        done = subprocess.run([sys.executable, PACKAGE / "examples" / name, *words], input="", text=True, capture_output=True, timeout=600, check=False,
                              env={**os.environ, "SLSD_SOCKET": "/nonexistent/slsd.sock", "PYTHONPATH": str(PACKAGE), "MPLBACKEND": "agg"})
        return done.returncode, done.stdout, done.stderr

    def test_is_what_wrong_arguments_get(self):
        self.assertEqual(set(self.RIGHT), {file.name for file in (PACKAGE / "examples").glob("*.py")})
        for name, cases in self.WRONG.items():
            for words in cases:
                status, out, error = self.said(name, words)
                self.assertEqual((status, out), (2, ""), (name, words, error))
                self.assertRegex(error, rf"(?s)^usage: {name} .*\n{name}: error: [^\n]+\n$", (name, words))

    def test_is_what_comes_without_a_service(self):
        for name, words in self.RIGHT.items():
            status, out, error = self.said(name, words)
            self.assertIn(status, (1, 2), (name, out, error))
            self.assertRegex(error, rf"^usage: {name}", name)
            self.assertNotIn("Traceback", error)
            missing = {"to_open3d.py": "open3d", "live_view.py": "matplotlib"}.get(name)
            if missing is None or there(missing):
                self.assertIn("/nonexistent/slsd.sock", error)
                self.assertIn("check that slsd runs", error)

    def test_names_the_recorded_frames(self):
        for name in self.RIGHT:
            text = (PACKAGE / "examples" / name).read_text(encoding="utf-8")
            configuration = re.search(r"slsd --config (\S+\.toml)", text)[1]
            self.assertTrue((HERE.parents[1] / configuration).is_file(), name)
            if name != "live_view.py":
                status, out, _ = self.said(name, ["--help"])
                self.assertEqual(status, 0, name)
                self.assertIn(configuration, out)


class Pick(unittest.TestCase):
    """Boxes before a wall: the front of the topmost is at 1920 mm, 220x180 mm about (-180, 150), turned by 12 degrees."""

    def place(self, service, *cup):
        said = run_example(service, "pick.py", *cup)
        point, normal = (np.array([float(word) for word in text.split()]) for text in
                         (said.split("mm ")[1].split(",")[0], said.split("normal ")[1].split(",")[0]))
        return point, normal

    def test_sets_the_cup_on_the_topmost_part(self):
        with recorded(CELL / "left") as service:
            for cup_mm in (40, 80):
                point, normal = self.place(service, cup_mm)
                self.assertLess(abs(point[2] - 1920), 0.5)
                self.assertGreater(normal @ (0, 0, -1), np.cos(np.radians(1)))
                turn = np.radians(12)
                on_box = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ (point[:2] - (-180, 150))
                self.assertTrue((np.abs(on_box) < (110 - cup_mm / 3, 90 - cup_mm / 3)).all(), on_box)

    def test_says_that_nothing_holds(self):
        with recorded(CELL / "left") as service:
            done = subprocess.run([sys.executable, PACKAGE / "examples/pick.py", "700"], env=environment(service), text=True,
                                  capture_output=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no place for this cup", done.stderr)


class Gap(unittest.TestCase):
    def test_is_measured_to_a_tenth_of_a_millimetre(self):
        with recorded(RECORDED / "gap") as service:
            for behind in ("160,110,240,230", "0,110,80,230", "0,105,240,235"):
                said = run_example(service, "gap.py", behind, "98,148,142,192", 2)
                measured, sigma = (float(text.split(" mm")[0]) for text in (said.split("gap ")[1], said.split("deviation ")[1]))
                self.assertLess(sigma, 0.1)
                self.assertLess(abs(measured - 15), 3 * sigma)

    def test_says_how_far_off_it_may_be(self):
        record = np.dtype([("x", "f4"), ("y", "f4"), ("z", "f4")])
        grid = np.mgrid[0:60, 0:60].reshape(2, -1)
        ratios = []
        for seed in range(40):
            draw = np.random.default_rng(seed)
            clouds = []
            for left, depth in ((0, 2000.0), (100, 1985.0)):
                points = np.zeros(grid.shape[1], record)
                points["x"], points["y"] = grid + [[left], [0]]
                # Neighbours err together, as those of a dense cloud do.
                waves = draw.normal(0, 0.1, (8, 8))[grid[0] // 8, grid[1] // 8]
                points["z"] = depth + 0.02 * points["x"] + waves + draw.normal(0, 0.1, grid.shape[1])
                clouds.append(points)
            found, sigma = gap.gap(np.concatenate(clouds), (0, 0, 60, 60), (100, 0, 160, 60))
            ratios.append((found - 15 / np.hypot(1, 0.02)) / sigma)
        self.assertTrue(0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.4, ratios)


class Drift(unittest.TestCase):
    def test_is_told_from_noise(self):
        with tempfile.TemporaryDirectory() as folder:
            frames = pathlib.Path(folder) / "frames"
            frames.mkdir()
            with recorded(RECORDED / "gap") as service, slsd.Scanner(service.socket) as scanner:
                image = scanner.frame().image.astype(float)
            draw = np.random.default_rng(1)
            for i, px in enumerate(np.linspace(0, 0.4, 8)):  # the camera turns
                moved = image + px * (np.roll(image, 1, axis=1) - image) + draw.normal(0, 1, image.shape)
                (frames / f"{i}.pgm").write_bytes(b"P5 %d %d 255\n" % image.shape[::-1] + np.clip(moved.round(), 0, 255).astype(np.uint8).tobytes())
            for source, drifts in ((frames, True), (RECORDED / "gap/frame.png", False)):
                file = pathlib.Path(folder) / f"{drifts}.csv"
                with Service(configuration=CONFIGURATION.format(source=HERE.parents[1], frames=source,
                                                                calibration=RECORDED / "gap/calibration.yml")) as service:
                    run_example(service, "drift.py", file, 0.2, 8)
                    said = run_example(service, "drift.py", file, "look").splitlines()
                self.assertEqual(len(said), 9)
                (self.assertGreater if drifts else self.assertEqual)(sum(line.endswith(": drift") for line in said), 5 if drifts else 0)
            self.assertEqual(len(file.read_text(encoding="utf-8").splitlines()), 9)

    def test_of_too_few_scans_is_not_told(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "few.csv"
            file.write_text(",".join(drift.COLUMNS) + "\n", encoding="utf-8")
            with self.assertRaisesRegex(ValueError, "too few"):
                drift.look(file)


class TurnTable(unittest.TestCase):
    def test_views_of_a_bust_close_its_surface(self):
        with tempfile.TemporaryDirectory() as folder, recorded(RECORDED / "turn_table") as service:
            out = pathlib.Path(folder) / "all.npy"
            run_example(service, "turn_table.py", out, 6, "0,0,2010", "0,1,0", text="\n" * 6)
            cloud = np.load(out)
        about = cloud - (0, 0, 2010)
        around = np.degrees(np.arctan2(about[:, 0], about[:, 2]))
        height = (about[:, 1] > -100) & (about[:, 1] < 100)
        self.assertGreater(np.histogram(around[height], 36, (-180, 180))[0].min(), 200)  # seen from all sides
        # What one view sees, the next one sees again, in the same place: the radius is one, direction by direction.
        cells = np.floor(np.column_stack([around / 3, about[:, 1] / 6])).astype(int)[height]
        radius = np.hypot(about[:, 0], about[:, 2])[height]
        _, which = np.unique(cells, axis=0, return_inverse=True)
        which = which.ravel()
        order = np.argsort(which)
        spreads = [np.ptp(np.percentile(radius[part], (25, 75))) for part in np.split(order, np.flatnonzero(np.diff(which[order])) + 1)
                   if len(part) > 30]
        self.assertGreater(len(spreads), 500)
        self.assertLess(np.median(spreads), 2.0)

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
