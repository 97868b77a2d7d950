#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-model on a recording of an object that numpy computes: what assimp and numpy read of its mesh, beside the truth."""
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree
import zipfile

import numpy as np

from turning_ball import (FOCUS, HERE, MIDDLE, PROGRAM, STEP_DEGREES, TurningBall, bumpy_ball, calibration, cloud, nothing,
                          off_truth_mm, pair, record, room, run, smooth_ball, turn)
import slsd
from mesh_test import mesh_ply
from service import Service, slsctl

TWO_BODIES = "two bodies in view move differently: show only one of them, or leave out the static one with --background or --box"


class Model(TurningBall):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("--from", cls.turning, "-o", cls.folder / "a.ply", "--json")
        assert done.returncode == 0, done.stderr
        cls.report, cls.messages = json.loads(done.stdout), done.stderr
        cls.points, cls.triangles = mesh_ply((cls.folder / "a.ply").read_bytes())

    def test_the_mesh_lies_on_the_truth(self):
        off = off_truth_mm(self.points)
        self.assertLess(np.sqrt((off ** 2).mean()), 0.07)  # mm; most of it is the places' error
        self.assertLess(np.quantile(abs(off), 0.95), 0.13)
        self.assertLess(abs(off).max(), 0.6)
        self.assertGreater(np.median(self.points["frames"]), 6)

    def test_the_mesh_is_a_manifold_that_faces_outward(self):
        directed = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        self.assertEqual(np.unique(directed, axis=0, return_counts=True)[1].max(), 1)
        self.assertEqual(np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)[1].max(), 2)
        self.assertEqual(len(np.unique(self.triangles)), len(self.points))
        corners = np.stack([self.points[axis] for axis in "xyz"], -1)[self.triangles].astype(float)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.assertGreater(((normals * (corners.mean(axis=1) - MIDDLE)).sum(axis=1) > 0).mean(), 0.999)

    def test_what_was_seen_is_there_and_poles_stay_open(self):
        """No cloud saw the poles: their normals are across every ray."""
        at = np.stack([self.points[axis] for axis in "xyz"], -1)[self.triangles] - MIDDLE
        area = np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1).sum() / 2
        self.assertGreater(area, 0.85 * 4 * np.pi * 50 ** 2)
        directed = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        rims = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
        rim = np.stack([self.points[axis] for axis in "xyz"], -1)[rims[0][rims[1] == 1].ravel()] - MIDDLE
        self.assertGreater(len(rim), 20)
        self.assertGreater(np.quantile(abs(rim[:, 1]), 0.1), 40)

    def test_a_closed_mesh_has_no_holes_and_marks_what_is_invented(self):
        done = run("--from", self.turning, "--close", "-o", self.folder / "closed.ply", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        points, triangles = mesh_ply((self.folder / "closed.ply").read_bytes())
        directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        self.assertEqual(np.unique(directed, axis=0, return_counts=True)[1].max(), 1)
        self.assertEqual(set(np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)[1]), {2})
        at = np.stack([points[axis] for axis in "xyz"], -1).astype(float) - MIDDLE
        corners = at[triangles]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        v = np.mgrid[-60:61:2, -60:61:2, -60:61:2].reshape(3, -1).T.astype(float)
        self.assertAlmostEqual(volume / ((bumpy_ball(v) < 0).sum() * 8), 1, delta=0.05)  # the poles are invented
        measured = points["frames"] > 0
        self.assertTrue(np.isnan(points["sigma_mm"][~measured]).all())
        self.assertTrue((points["sigma_mm"][measured] > 0).all())
        self.assertLess(np.quantile(abs(off_truth_mm(points[measured])), 0.95), 0.13)
        self.assertGreater(np.quantile(abs(at[~measured, 1]), 0.1), 35)  # they lie at the poles
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        self.assertAlmostEqual(json.loads(done.stdout)["invented_share"],
                               areas[~measured[triangles].all(axis=1)].sum() / areas.sum(), delta=0.001)

    def test_the_report_is_true(self):
        self.assertEqual((self.report["frames"], len(self.report["fused"]), self.report["refused"]), (30, 30, []))
        self.assertTrue(self.report["closed"])
        self.assertAlmostEqual(self.report["turned_degrees"], 360 - STEP_DEGREES, delta=1)
        self.assertLess(self.report["drift_mm"], 0.3)
        self.assertLess(self.report["seam_mm"], 0.03)
        self.assertAlmostEqual(self.report["residual_over_sigma"], 1, delta=0.3)
        self.assertEqual(self.report["triangles"], len(self.triangles))
        for i, frame in enumerate(self.report["fused"]):
            rotation = np.array(frame["rotation"]).reshape(3, 3)
            self.assertLess(abs(rotation - turn(-STEP_DEGREES * i)).max(), 0.002)
            self.assertLess(abs(rotation @ MIDDLE + frame["translation_mm"] - MIDDLE).max(), 0.15)

    def test_another_program_reads_every_format(self):
        counts = set()
        for name in ("a.ply", "b.stl", "b.obj", "b.glb"):
            if name != "a.ply":
                self.assertEqual(run("--from", self.turning, "-o", self.folder / name).returncode, 0)
            done = subprocess.run(("assimp", "info", self.folder / name, "--raw"), capture_output=True, text=True, timeout=300,
                                  check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            counts.add(re.search(r"^Faces: +(\d+)", done.stdout, re.M)[1])
        self.assertEqual(counts, {str(len(self.triangles))})

    def read_3mf(self, *options):
        """The one object's type, its vertices and triangles, as the standard library reads them."""
        file = self.folder / "c.3mf"
        self.assertEqual(run("--from", self.turning, "-o", file, *options).returncode, 0)
        with zipfile.ZipFile(file) as archive:
            model = xml.etree.ElementTree.fromstring(archive.read("3D/3dmodel.model"))
        space = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
        self.assertEqual(model.get("unit"), "millimeter")
        (thing,) = model.iter(space + "object")
        self.assertEqual([item.get("objectid") for item in model.iter(space + "item")], [thing.get("id")])
        vertices = [[float(vertex.get(axis)) for axis in "xyz"] for vertex in model.iter(space + "vertex")]
        triangles = [[int(triangle.get(corner)) for corner in ("v1", "v2", "v3")] for triangle in model.iter(space + "triangle")]
        return thing.get("type"), np.array(vertices), np.array(triangles)

    def test_3mf_has_the_same_mesh_and_its_kind(self):
        kind, vertices, triangles = self.read_3mf()
        self.assertEqual(kind, "surface")  # the poles are open
        np.testing.assert_array_equal(triangles, self.triangles)
        np.testing.assert_allclose(vertices, np.stack([self.points[axis] for axis in "xyz"], -1), atol=1e-4)
        self.assertEqual(self.read_3mf("--close")[0], "model")

    def test_frames_that_do_not_fit_are_named_and_left_out(self):
        clouds = self.clouds[:5] + [cloud(smooth_ball, 0, 1), self.clouds[20], self.clouds[5][:-9]] + self.clouds[5:8]
        done = run("--from", record(self.folder / "strange", clouds), "-o", self.folder / "c.ply", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        self.assertEqual([frame["frame"][-6:-4] for frame in report["refused"]], ["05", "06", "07"])
        self.assertEqual([frame["frame"][-6:-4] for frame in report["fused"]], ["00", "01", "02", "03", "04", "08", "09", "10"])
        self.assertIn("is cut", report["refused"][2]["reason"])
        self.assertFalse(report["closed"])
        self.assertEqual(done.stderr.count("left out"), 3)
        self.assertLess(np.quantile(abs(off_truth_mm(mesh_ply((self.folder / "c.ply").read_bytes())[0])), 0.95), 0.13)

    def left_out(self, done):
        """The reason by number of the cloud."""
        return {int(number): why for number, why in re.findall(r"(?m)^slsd-model: clouds/(\d+).ply: left out: (.*)$", done.stderr)}

    def test_two_bodies_that_move_differently_give_no_mesh(self):
        turns = {"against": lambda i: (8 * i, -8 * i), "one stands": lambda i: (0, 10 * i), "slowly": lambda i: (4 * i, -4 * i)}
        for name, degrees in turns.items():
            with self.subTest(name=name):
                two = record(self.folder / name, [cloud(pair(*degrees(i)), 0, i) for i in range(5)])
                done = run("--from", two, "-o", self.folder / "two.ply")
                self.assertEqual((done.returncode, done.stdout), (1, ""))
                why = self.left_out(done)
                for i in range(3 if name == "slowly" else 1, 5):
                    self.assertEqual(why[i], TWO_BODIES)
                self.assertRegex(done.stderr, f"no place was measured by two clouds: 4 of 5 were left out; clouds/0000000\\d.ply: {TWO_BODIES}\n$")
                self.assertFalse((self.folder / "two.ply").exists())

    def test_what_was_measured_before_two_bodies_part_is_the_model(self):
        clouds = [cloud(pair(0, 10 * max(0, i - 2)), 10 * i, i) for i in range(5)]
        done = run("--from", record(self.folder / "part", clouds), "-o", self.folder / "before.ply", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.left_out(done), {3: TWO_BODIES, 4: TWO_BODIES})
        self.assertEqual([frame["frame"][-6:-4] for frame in json.loads(done.stdout)["fused"]], ["00", "01", "02"])

    def test_what_gives_no_model_says_why(self):
        ball = record(self.folder / "ball", [cloud(smooth_ball, degrees, degrees) for degrees in (0, 10)])
        other = record(self.folder / "other", self.clouds[:2])
        (other / "calibration.yml").write_text(calibration(1.01 * FOCUS), encoding="utf-8")
        lone = record(self.folder / "lone", self.clouds[:1])
        cases = {lone: "no place was measured by two clouds", other: "another calibration", self.folder: "is not a recording",
                 ball: "too little relief to determine turning about the axis"}
        for folder, expected in cases.items():
            with self.subTest(expected=expected):
                done = run("--from", folder, "-o", self.folder / "none.ply")
                self.assertEqual(done.returncode, 1)
                self.assertIn(expected, done.stderr)
                self.assertFalse((self.folder / "none.ply").exists())

    def test_a_dense_recording_of_slsctl_is_all_that_it_needs(self):
        scene = HERE.parent / "corpus/16px-5-bust"
        configuration = (f'[pattern]\nfile = "{scene}/pattern.toml"\n[[camera]]\nname = "camera"\npath = "{scene}/frame.png"\n'
                         f'[calibration]\nfile = "{scene}/calibration.yml"\n[scan]\ntimeout_ms = 600000\n'
                         '[server]\nsocket = "slsd.sock"\n')
        with tempfile.TemporaryDirectory() as folder, Service(configuration=configuration) as service:
            service.wait_ready()
            recording = pathlib.Path(folder) / "recording"
            for density, status in (("symbols", 1), ("pixels", 0)):
                recorded = slsctl("--socket", service.socket, "record", recording, "--frames", "2", "--clouds", "--density", density,
                                  "--box=-300,-300,1700,300,300,2250")
                self.assertEqual(recorded.returncode, 0, recorded.stderr)
                made = subprocess.run([PROGRAM, "--from", recording, "-o", pathlib.Path(folder) / "bust.ply", "--json"],
                                      capture_output=True, text=True, check=False)
                self.assertEqual(made.returncode, status, made.stderr)
                if density == "symbols":
                    self.assertIn("scan or record again with --density pixels", made.stderr)
                    shutil.rmtree(recording)
            report = json.loads(made.stdout)
            self.assertEqual((len(report["fused"]), report["refused"]), (2, []))
            shutil.rmtree(recording)
            slsctl("--socket", service.socket, "record", recording, "--frames", "1", "--clouds", "--density", "pixels", "--stride", "3")
            made = subprocess.run([PROGRAM, "--from", recording, "-o", pathlib.Path(folder) / "bust.ply"], capture_output=True, text=True,
                                  check=False)
            self.assertIn("stride or voxel_mm thinned the cloud", made.stderr)

    def test_a_cut_recording_is_used_as_far_as_it_goes(self):
        cut = record(self.folder / "cut", self.clouds[:4], scans=0)
        done = run("--from", cut, "-o", self.folder / "d.ply")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("the recording was cut: its first 4 clouds are used", done.stderr)

    def test_lines_of_progress_tell_it_to_other_programs(self):
        done = run("--from", self.turning, "-o", self.folder / "p.ply", "-o", self.folder / "p.stl", "--progress", "--preview",
                   self.folder / "preview.ply")
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        told = [line["progress"] for line in lines if "progress" in line]
        self.assertEqual([each["placed"] for each in told], list(range(1, 31)))
        self.assertEqual([each["clouds"] for each in told], list(range(1, 31)))
        self.assertEqual(len(told[-1]["views_degrees"]), 30)
        np.testing.assert_allclose(told[-1]["views_degrees"], range(0, 360, STEP_DEGREES), atol=2)
        self.assertAlmostEqual(told[9]["seen_degrees"], 9 * STEP_DEGREES, delta=6)
        self.assertAlmostEqual(told[9]["missing_from_degrees"], 9 * STEP_DEGREES, delta=6)
        self.assertEqual([each["seen_from_all_sides"] for each in told], [False] * 28 + [True] * 2)
        fused = [line["building"]["fused"] for line in lines if "building" in line]
        self.assertEqual(fused, [0, *range(31)])
        self.assertEqual(list(lines[-1]), ["report"])
        self.assertEqual(lines[-1]["report"], self.report)
        points = self.preview(self.folder / "preview.ply")
        self.assertLess(len(points), 120_000)
        self.assertTrue((points["sigma_mm"] > 0).all())
        self.assertEqual((self.folder / "p.ply").read_bytes(), (self.folder / "a.ply").read_bytes())
        self.assertEqual(len((self.folder / "p.stl").read_bytes()), 84 + 50 * len(self.triangles))

    def test_lines_of_progress_end_with_the_error(self):
        lone = record(self.folder / "lonely", self.clouds[:1])
        done = run("--from", lone, "-o", self.folder / "none.ply", "--progress")
        self.assertEqual(done.returncode, 1)
        error = json.loads(done.stdout.splitlines()[-1])["error"]
        self.assertIn("no place was measured by two clouds", error["message"])
        self.assertIn(error["message"], done.stderr)

    def test_a_preview_that_cannot_be_written_is_no_end(self):
        done = run("--from", self.turning, "-o", self.folder / "p.ply", "--preview", self.folder / "missing/preview.ply")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("no more previews: "), 1)

    def test_a_report_that_finds_no_room_says_so(self):
        few = record(self.folder / "few", self.clouds[:3])
        for form in ((), ("--json",), ("--progress",)):
            with open("/dev/full", "w", encoding="utf-8") as full:
                done = subprocess.run((PROGRAM, "--from", few, "-o", self.folder / "few.stl", "--voxel", "3", *form), stdout=full,
                                      stderr=subprocess.PIPE, text=True, timeout=600, check=False)
            self.assertEqual(done.returncode, 1, form)
            self.assertEqual(done.stderr.count("cannot write the report to standard output: check whether its disk is full"), 1)
            self.assertGreater((self.folder / "few.stl").stat().st_size, 1000)
            (self.folder / "few.stl").unlink()

    def test_a_box_leaves_out_what_lies_beside(self):
        rows = [cloud(bumpy_ball, degrees, degrees) for degrees in (0, 12, 24)]
        boxed = record(self.folder / "boxed", rows)
        done = run("--from", boxed, "-o", self.folder / "half.ply", "--box", -100, 0, 500, 100, 100, 700)
        self.assertEqual(done.returncode, 0, done.stderr)
        points, _ = mesh_ply((self.folder / "half.ply").read_bytes())
        self.assertGreater(points["y"].min(), -3)
        self.assertLess(abs(points["y"].max() - 50), 8)

    def test_a_background_is_left_out(self):
        """Floor and wall stand still: most of each cloud. Without them the mesh is as that of the object alone."""
        steps = range(0, 360, STEP_DEGREES)
        scene = record(self.folder / "scene", [cloud(bumpy_ball, degrees, degrees, room) for degrees in steps])
        empty = self.folder / "empty.ply"
        empty.write_bytes(cloud(nothing, 0, 1000, room))
        done = run("--from", scene, "-o", self.folder / "of_scene.ply", "--background", empty, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["refused"], [])
        points, triangles = mesh_ply((self.folder / "of_scene.ply").read_bytes())
        off = off_truth_mm(points)
        print(f"with a background: RMS {np.sqrt((off ** 2).mean()):.3f} mm, most {abs(off).max():.2f} mm, {len(triangles)} triangles")
        self.assertLess(np.sqrt((off ** 2).mean()), 0.07)
        self.assertLess(abs(off).max(), 0.6)
        self.assertAlmostEqual(len(triangles) / len(self.triangles), 1, delta=0.05)

    def test_a_background_that_is_none_is_refused(self):
        broken, other, bare = (self.folder / name for name in ("broken.ply", "other.ply", "bare.ply"))
        broken.write_bytes(b"ply\n")
        points = np.frombuffer(self.clouds[0].split(b"end_header\n", 1)[1], "V18").copy()
        head = self.clouds[0].split(b"end_header\n", 1)[0] + b"end_header\n"
        fields = np.dtype([("xyz", "<f4", 3), ("sigma", "<f4"), ("intensity", "u1"), ("camera", "u1")])
        shifted = points.view(fields).copy()
        shifted["xyz"] *= [1.1, 1, 1]
        other.write_bytes(head + shifted.tobytes())
        bare.write_bytes(head.replace(b"vertex %d" % len(points), b"vertex 0"))
        for file, words in ((broken, "broken.ply"), (other, "other.ply: .*another calibration"), (bare, "bare.ply: .*no points"),
                            (self.folder / "missing.ply", "missing.ply")):
            done = run("--from", self.turning, "-o", self.folder / "none.ply", "--background", file)
            self.assertEqual(done.returncode, 1, file)
            self.assertRegex(done.stderr, words)
            self.assertFalse((self.folder / "none.ply").exists())

    def test_python_gives_the_same_mesh_as_arrays(self):
        with slsd.Model(calibration(), self.folder / "python", str(PROGRAM)) as model:
            for each in self.clouds:
                model.add(slsd.read_ply(each))
            self.assertEqual(len(model), 30)
            mesh = model.mesh()
            np.testing.assert_array_equal(mesh.triangles, self.triangles)
            np.testing.assert_array_equal(mesh.points, self.points)
            self.assertEqual(mesh.xyz.shape, (len(self.points), 3))
            self.assertEqual(mesh.report, self.report)
            report = model.save(self.folder / "python.stl", close=True, voxel_mm=2, box=[-40, -100, 500, 100, 100, 700])
            self.assertEqual(report["voxel_mm"], 2)
            self.assertGreater(report["invented_share"], 0)
            with self.assertRaisesRegex(slsd.ScannerError, "no frame is usable: clouds/00000000.ply: it shows almost nothing"):
                with slsd.Model(calibration(), program=str(PROGRAM)) as other:
                    other.add(slsd.read_ply(self.clouds[0]))
                    other.mesh(background=slsd.read_ply(self.clouds[0]))
        again = run("--from", self.folder / "python", "-o", self.folder / "python.ply", "--json")
        self.assertEqual(json.loads(again.stdout), self.report)  # a folder that is kept is a recording

    def test_python_says_what_is_wrong(self):
        model = slsd.Model(calibration(), program=str(PROGRAM))
        self.addCleanup(model.close)
        with self.assertRaisesRegex(slsd.ScannerError, "has no clouds"):
            model.mesh()
        symbols = slsd.Cloud(np.zeros(3, [("x", "<f4"), ("sigma_mm", "<f4"), ("symbol", "u1")]), {}, {})
        with self.assertRaisesRegex(ValueError, "clouds of pixels"):
            model.add(symbols)
        turned = slsd.read_ply(self.clouds[0])
        turned.comments["coordinate_frame"] = "robot_base: the robot's"
        with self.assertRaisesRegex(ValueError, "scanner's frame"):
            model.add(turned)
        model.add(slsd.read_ply(self.clouds[0]))
        with self.assertRaisesRegex(slsd.ScannerError, "no place was measured by two clouds"):
            model.mesh()
        with self.assertRaises(FileExistsError):
            slsd.Model(calibration(), self.turning, str(PROGRAM))
        with self.assertRaisesRegex(slsd.NotFound, "install the package slsd-model"):
            slsd.Model(calibration(), program="/nonexistent/slsd-model")

    def test_wrong_usage(self):
        cases = {("--from", "x"): "--output", ("--from", "x", "-o", "a.txt"): ".ply, .stl, .obj, .glb or .3mf",
                 ("--from", "x", "-o", "a.ply", "--voxel", "0"): "0.01", ("-o", "a.ply", "--turntable"): "--views",
                 ("-o", "a.ply", "--from", "x", "--until-closed"): "--from",
                 ("-o", "a.ply", "--box", "1", "0", "0", "0", "1", "1"): "the least x, y and z"}
        for arguments, expected in cases.items():
            with self.subTest(arguments=arguments):
                done = run(*arguments)
                self.assertEqual(done.returncode, 2)
                self.assertIn(expected, done.stderr)


if __name__ == "__main__":
    unittest.main()
