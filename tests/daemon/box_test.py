#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A part of the scene: the box of the configuration or of a request, one point to a cube, every Nth row and column; and
boxes that no camera sees, which change nothing."""
import json
import pathlib
import tempfile
import unittest

import numpy as np

from client import RpcError
from dense_test import PIXEL_SCAN, pcd, ply, tiff_pages
from point_cloud import vertices
from service import SCENE, Service, slsctl, wait_until

INVALID_PARAMS = -32602
BOX = [-150.0, -100.0, 1900.0, 120.0, 60.0, 2100.0]  # the wall is at 2000 mm
AWAY = [5000.0, 0.0, 1900.0, 5100.0, 50.0, 2100.0]


def of_box(points, box=BOX):
    """Those points, found without our code."""
    at = np.stack([points[name] for name in "xyz"], axis=1)
    return points[((at >= np.float32(box[:3])) & (at <= np.float32(box[3:]))).all(axis=1)]


def places(cloud):
    """The points of symbols."""
    return np.array(vertices(cloud), np.float32)


def places_of_box(points):
    return points[((points >= np.float32(BOX[:3])) & (points <= np.float32(BOX[3:]))).all(axis=1)]


class Box(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.client = cls.service.client()
        cls.addClassCleanup(cls.client.close)
        cls.service.wait_ready()
        cls.pixels = ply(cls.client.call("scan", **PIXEL_SCAN)[1])[1]
        cls.symbols = places(cls.client.call("scan")[1])

    def setUp(self):
        self.addCleanup(self.call, "set", cloud={"box": None, "plane": None, "voxel_mm": None, "stride": None})

    def call(self, method, **params):
        return self.client.call(method, **params)[0]

    def points(self, **params):
        return ply(self.client.call("scan", **params)[1])[1]

    def assert_same_points(self, some, others):
        """The same pixels; depths differ by less than their sigma, as blur and offset come from the symbols of the box."""
        self.assertEqual(len(some), len(others))
        np.testing.assert_allclose(some["x"], others["x"], atol=0.2)
        off = np.abs(some["z"] - others["z"]) / others["sigma_mm"]
        self.assertLess(np.median(off), 0.1)
        self.assertLess(np.quantile(off, 0.99), 0.5)
        self.assertLess(off.max(), 3)

    def test_of_a_request_gives_the_points_of_the_whole_cloud(self):
        self.assert_same_points(self.points(box=BOX, **PIXEL_SCAN), of_box(self.pixels))
        np.testing.assert_array_equal(places(self.client.call("scan", box=BOX)[1]), places_of_box(self.symbols))
        self.assertGreater(len(of_box(self.pixels)), 10_000)
        self.assertEqual(len(self.points(**PIXEL_SCAN)), len(self.pixels))  # that of a request alone

    def test_of_the_configuration_is_that_of_all_requests(self):
        self.call("set", cloud={"box": BOX})
        self.assert_same_points(self.points(**PIXEL_SCAN), of_box(self.pixels))
        np.testing.assert_array_equal(places(self.client.call("scan")[1]), places_of_box(self.symbols))
        self.assertEqual(len(self.points(box=[], **PIXEL_SCAN)), len(self.pixels))  # unless they have none
        with self.service.client() as client:
            client.call("subscribe", density="pixels")
            for _ in range(2):
                self.assert_same_points(ply(client.receive()[1])[1], of_box(self.pixels))

    def test_keeps_the_order_of_the_camera(self):
        fields, width, height, records = pcd(self.client.call("scan", box=BOX, format="pcd", **PIXEL_SCAN)[1])
        self.assertEqual((width, height), (1600, 1200))
        depth = tiff_pages(self.client.call("scan", box=BOX, format="tiff", **PIXEL_SCAN)[1])[0][2]
        np.testing.assert_array_equal(depth, records["z"])
        self.assertEqual(np.count_nonzero(~np.isnan(depth)), len(of_box(self.pixels)))

    def test_counts_what_it_leaves_out(self):
        scan = self.call("scan", box=BOX, **PIXEL_SCAN)
        self.assertEqual(sum(scan["pixels"].values()), 1600 * 1200)
        self.assertEqual(scan["pixels"]["measured"], scan["points"])
        self.assertGreater(scan["pixels"]["outside_box"], 1_500_000)

    def test_stride_keeps_columns_and_rows(self):
        few = self.points(stride=3, **PIXEL_SCAN)
        self.assertLess(abs(len(few) - len(self.pixels) / 9), 0.01 * len(self.pixels))
        depth = tiff_pages(self.client.call("scan", stride=3, format="tiff", **PIXEL_SCAN)[1])[0][2].reshape(1200, 1600)
        rows, columns = np.nonzero(~np.isnan(depth))
        self.assertEqual((set(rows % 3), set(columns % 3)), ({0}, {0}))

    def test_voxels_have_one_point_each_the_most_certain(self):
        few = self.points(box=BOX, voxel_mm=10, **PIXEL_SCAN)

        def by_cube(points):
            cubes = {}
            for x, y, z, sigma in zip(*(points[name].astype(float) for name in ("x", "y", "z", "sigma_mm"))):
                cubes.setdefault((x // 10, y // 10, z // 10), []).append(sigma)
            return cubes

        kept, whole = by_cube(few), by_cube(self.points(box=BOX, **PIXEL_SCAN))
        self.assertEqual({len(sigmas) for sigmas in kept.values()}, {1})
        self.assertEqual(set(kept), set(whole))
        for cube in kept:
            self.assertEqual(kept[cube][0], min(whole[cube]))

    def test_without_points_says_why(self):
        for density in (PIXEL_SCAN, {}):
            scan = self.call("scan", box=[-150, -100, 1500, 120, 60, 1600], **density)
            self.assertEqual(scan["points"], 0)
            self.assertIn("within the box", scan["empty"])

    def test_without_symbols_says_where_it_looked(self):
        with Service(camera_path=SCENE / "black.png") as service, service.client() as client:
            service.wait_ready()
            for density in (PIXEL_SCAN, {}):
                whole, part = (client.call("scan", **box, **density)[0] for box in ({}, {"box": BOX}))
                self.assertEqual((whole["points"], part["points"]), (0, 0))
                self.assertIn("no symbol of the pattern was decoded", whole["empty"])
                self.assertEqual(part["empty"], "in the part of the picture that can see the box: " + whole["empty"])

    def refused(self, method, **params):
        with self.assertRaises(RpcError) as refused:
            self.client.call(method, **params)
        return refused.exception.code, str(refused.exception)

    def test_that_no_camera_sees_is_refused_and_nothing_changes(self):
        self.call("set", cloud={"box": BOX})
        before = self.call("settings")["set"]
        behind, beyond = [-50, -50, -900, 50, 50, -500], [-50, -50, 2600, 50, 50, 3000]
        for box in (AWAY, behind, beyond):
            for method, params in (("scan", {"box": box}), ("scan", {"box": box, **PIXEL_SCAN}), ("set", {"cloud": {"box": [float(n) for n in box]}})):
                code, message = self.refused(method, **params)
                self.assertEqual(code, -32001, message)
                self.assertIn("no camera sees the box", message)
                self.assertIn("in the frame of the first camera", message)
            self.assertEqual(self.call("settings")["set"], before)
        self.assert_same_points(self.points(**PIXEL_SCAN), of_box(self.pixels))

    def test_that_is_no_box_is_refused(self):
        swapped = BOX[3:] + BOX[:3]
        for params in ({"box": BOX[:5]}, {"box": swapped}, {"box": [*BOX[:5], 1e7]}, {"box": ["a"] * 6}, {"box": 3}, {"voxel_mm": -1}, {"voxel_mm": 1e4},
                       {"plane": [0, 0, 1]}, {"plane": [0, 0, 2, 5]}, {"plane": [0, 0, 1, 1e7]}, {"box_frame": "world"},
                       {"stride": 0}, {"stride": 65}, {"stride": 1.5}):
            code, message = self.refused("scan", **params)
            self.assertEqual(code, INVALID_PARAMS, message)
            self.assertIn(f'"{next(iter(params))}"', message)
            code, message = self.refused("set", cloud=params)
            self.assertIn(next(iter(params)), message)
        self.assertEqual(len(self.points(**PIXEL_SCAN)), len(self.pixels))

    def test_that_skips_pixels_needs_pixels(self):
        code, message = self.refused("scan", stride=2)
        self.assertEqual((code, message), (INVALID_PARAMS, '"stride" above 1 needs "density": "pixels"'))
        self.assertEqual(self.call("scan", stride=1)["points"], len(self.symbols))
        self.call("set", cloud={"stride": 2})
        self.assertEqual(self.call("scan")["points"], len(self.symbols))  # the configured one is for dense clouds alone
        self.assertEqual(self.refused("scan", stride=3)[0], INVALID_PARAMS)
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as state, Service(environment={"STATE_DIRECTORY": state}) as service, service.client() as client:
            client.call("set", decode={"density": "pixels"})
            client.call("preset", action="save", name="dense")
            client.call("set", decode={"density": None})
            self.assertGreater(client.call("scan", preset="dense", stride=8)[0]["points"], len(self.symbols))

    def test_of_a_plane_drops_what_is_on_it_or_behind(self):
        plane = [0.6, 0.0, -0.8, -1600.0]
        def side(points):
            return points["x"] * 0.6 - points["z"] * 0.8 > -1600
        self.assert_same_points(self.points(plane=plane, **PIXEL_SCAN), self.pixels[side(self.pixels)])
        scan = self.call("scan", plane=plane, **PIXEL_SCAN)
        self.assertEqual(scan["pixels"]["behind_plane"], np.count_nonzero(~side(self.pixels)))
        scan = self.call("scan", plane=[0, 0, -1, -100])
        self.assertEqual(scan["points"], 0)
        self.assertIn("in front of the plane", scan["empty"])

    def test_of_a_plane_that_was_measured(self):
        words = ["--socket", str(self.service.socket)]
        shown = slsctl(*words, "plane", "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        found = json.loads(shown.stdout)
        normal = np.linalg.svd(self.symbols - self.symbols.mean(axis=0))[2][2]  # without our code
        self.assertGreater(abs(normal @ found["plane"][:3]), 1 - 1e-5)
        self.assertLess(abs(found["plane"][3] - found["margin_mm"] - found["plane"][:3] @ self.symbols.mean(axis=0)), 0.5)
        self.assertNotIn("cloud", self.call("settings")["set"])
        done = slsctl(*words, "plane", "--set")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("It is in force", done.stdout)
        self.assertLess(self.call("scan")["points"], len(self.symbols) / 50)
        again = json.loads(slsctl(*words, "plane", "--json", "--margin-mm", "3").stdout)  # of what is there, not of what is left
        self.assertEqual((again["points"], again["margin_mm"]), (len(self.symbols), 3))
        self.call("set", cloud={"plane": None})

    def test_belongs_to_a_preset(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as state, Service(environment={"STATE_DIRECTORY": state}) as service, service.client() as client:
            client.call("set", cloud={"box": BOX})
            client.call("preset", action="save", name="part-a")
            client.call("set", cloud={"box": None})
            self.assertEqual(client.call("scan")[0]["points"], len(self.symbols))
            self.assertEqual(client.call("scan", preset="part-a")[0]["points"], len(places_of_box(self.symbols)))

    def test_on_the_command_line(self):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            cloud = pathlib.Path(folder) / "cloud.ply"
            words = ["--socket", str(self.service.socket), "scan", str(cloud), "--density", "pixels", "--timeout-ms", "600000"]
            done = slsctl(*words, "--box", ",".join(map(str, BOX)))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assert_same_points(ply(cloud.read_bytes())[1], of_box(self.pixels))
            done = slsctl(*words, "--box", ",".join(map(str, BOX)), "--stride", "2", "--voxel-mm", "10")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertLess(len(ply(cloud.read_bytes())[1]), len(of_box(self.pixels)) / 4)
            kept = cloud.read_bytes()
            done = slsctl(*words, "--box", ",".join(map(str, AWAY)))
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
            self.assertIn("no camera sees the box", done.stderr)
            self.assertEqual(cloud.read_bytes(), kept)
            for wrong in (("--box", "1,2,3"), ("--box", "1,2,3,4,5,x"), ("--stride", "0"), ("--voxel-mm", "-1")):
                self.assertEqual(slsctl(*words, *wrong).returncode, 2, wrong)
            for command in (["scan", str(cloud)], ["record", folder + "/record"]):
                done = slsctl(*words[:2], *command, "--density", "symbols", "--stride", "2")
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn("--stride needs --density pixels", done.stderr)
                done = slsctl(*words[:2], *command, "--stride", "2")
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn('"stride" above 1 needs "density": "pixels"', done.stderr)


class BoxOfAFile(unittest.TestCase):
    def test_that_no_camera_sees_stops_the_start(self):
        service = Service(camera=f"\n[cloud]\nbox = {AWAY}\n")
        service.launch()
        wait_until(lambda: service.process.poll() is not None, "the end")
        self.assertNotEqual(service.process.returncode, 0)
        self.assertIn("[cloud] box: no camera sees the box", service.log_text())

    def test_comes_with_a_reload_and_a_wrong_one_does_not(self):
        with Service() as service, service.client() as client:
            whole = client.call("scan")[0]["points"]
            service.configure(camera=f"\n[cloud]\nbox = {BOX}\n")
            client.call("reload")
            part = client.call("scan")[0]["points"]
            self.assertLess(part, whole / 4)
            service.configure(camera=f"\n[cloud]\nbox = {AWAY}\n")
            with self.assertRaisesRegex(RpcError, "no camera sees the box"):
                client.call("reload")
            self.assertEqual(client.call("scan")[0]["points"], part)


if __name__ == "__main__":
    unittest.main(verbosity=2)
