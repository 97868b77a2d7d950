#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-model on a recording of an object that numpy computes: what assimp and numpy read of its mesh, beside the truth."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "clients/python"
sys.path[:0] = [str(HERE.parent / "daemon"), str(PACKAGE)]

import numpy as np  # noqa: E402

import slsd  # noqa: E402
from impostor import Impostor, result  # noqa: E402
from mesh_test import mesh_ply  # noqa: E402
from service import Service, slsctl  # noqa: E402

PROGRAM = pathlib.Path(os.environ["SLSD_BIN"]) / "slsd-model"
WIDTH, HEIGHT, FOCUS = 220, 200, 1000.0
MIDDLE = np.array([0, 0, 600.0])
# Runs a program in a folder, on a disk of its own or under a limit, and copies what it left.
ON_A_DISK = """[ -z "$SIZE" ] || mount -t tmpfs -o "size=$SIZE" none "$DISK" || exit
cd "$DISK" && echo before > model.stl || exit
([ -z "$LIMIT" ] || ulimit -f "$LIMIT"; trap "" XFSZ; exec "$@"); status=$?
cp -r . "$AFTER"; exit $status"""
TWO_BODIES = "two bodies in view move differently: show only one of them, or leave out the static one with --background or --box"
OWN_MOUNTS = ("unshare", "--mount", "--map-root-user")
PYTHON_ASKS = ("transport", "timeout_ms", "normals", "texture", "ambient", "picture", "why")
STEP_DEGREES, SIGMA_MM, ALIKE_PX = 12, 0.05, 6


def bumpy_ball(at):
    """Signed distance to a ball of 50 mm with bumps of up to 5 mm, scaled so that rays can step by it."""
    x, y, z = at.T
    bumps = (np.sin(0.07 * x + 1) * np.sin(0.09 * y) + 0.6 * np.sin(0.11 * z + 2)
             + 0.4 * np.sin(0.15 * x - 0.05 * z) * np.cos(0.13 * y + 1))
    return 0.7 * (np.linalg.norm(at, axis=1) - 50 - 2.5 * bumps)


def smooth_ball(at):
    return np.linalg.norm(at, axis=1) - 50


def pair(left_degrees, right_degrees):
    """Signed distance to two bumpy balls of 25 mm side by side, each turned by itself."""
    def distance(at):
        balls = ((at + [29.0, 0, 0]) @ turn(left_degrees), (at - [29.0, 0, 0]) @ turn(90 + right_degrees))
        return 0.5 * np.minimum(*(bumpy_ball(2 * ball) for ball in balls))
    return distance


def turn(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def errors(random):
    """Of sigma 1, alike over some pixels as those of dense clouds."""
    coarse = random.standard_normal((HEIGHT // ALIKE_PX + 2, WIDTH // ALIKE_PX + 2))
    v, u = np.mgrid[:HEIGHT, :WIDTH] / ALIKE_PX
    i, j = v.astype(int), u.astype(int)
    v, u = v - i, u - j
    weights = ((1 - v) * (1 - u), (1 - v) * u, v * (1 - u), v * u)
    places = ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1))
    return sum(w * coarse[place] for w, place in zip(weights, places)) / np.sqrt(sum(w * w for w in weights))


def nothing(at):
    return np.full(len(at), 1000.0)


def room(at):
    """Signed distance to a floor below the object and a tilted wall behind it, in the rig's frame."""
    tilted = np.array([0.3, 0, -1]) / np.hypot(0.3, 1)
    return np.minimum(57 - at[:, 1], (at - [0, 0, 665]) @ tilted)


def cloud(distance, degrees, seed, behind=nothing):
    """A dense cloud as PLY.

    behind  signed distance to what does not turn, in the rig's frame
    """
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    rays = np.stack([(u - (WIDTH - 1) / 2) / FOCUS, (v - (HEIGHT - 1) / 2) / FOCUS, np.ones_like(u)], -1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    far, hit = np.full(len(rays), 520.0), np.zeros(len(rays), bool)
    nearest = rays * (rays @ MIDDLE)[:, None]
    near = np.linalg.norm(nearest - MIDDLE, axis=1) < 57
    going = np.arange(len(rays)) if behind is room else np.flatnonzero(near)
    for _ in range(120):
        at = rays[going] * far[going, None]
        left = np.minimum(np.where(near[going], distance((at - MIDDLE) @ turn(degrees)), np.inf), behind(at))
        far[going] += left
        hit[going[left < 1e-4]] = True
        going = going[(left >= 1e-4) & (far[going] < 700)]
    far += SIGMA_MM * errors(np.random.default_rng(seed)).ravel()
    points = np.zeros(hit.sum(), [("xyz", "<f4", 3), ("sigma", "<f4"), ("intensity", "u1"), ("camera", "u1")])
    points["xyz"], points["sigma"], points["intensity"] = (rays * far[:, None])[hit], SIGMA_MM, 90
    fields = "".join(f"property {kind}\n" for kind in ("float x", "float y", "float z", "float sigma_mm", "uchar intensity",
                                                        "uchar camera"))
    return (f"ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {len(points)}\n{fields}end_header\n"
            .encode() + points.tobytes())


def coloured(ply):
    """The same cloud with red 200, green 100, blue 50."""
    header, body = ply.split(b"end_header\n", 1)
    plain = np.frombuffer(body, "V18")
    points = np.zeros(len(plain), [("plain", "V18"), ("colour", "u1", 3)])
    points["plain"], points["colour"] = plain, (200, 100, 50)
    lines = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    return header + lines.encode() + b"end_header\n" + points.tobytes()


def matrix(name, rows):
    rows = np.asarray(rows, float)
    return (f"{name}: !!opencv-matrix\n   rows: {rows.shape[0]}\n   cols: {rows.shape[1]}\n   dt: d\n"
            f"   data: [ {', '.join(map(str, rows.ravel()))} ]\n")


def calibration(focus=FOCUS):
    camera = [[focus, 0, (WIDTH - 1) / 2], [0, focus, (HEIGHT - 1) / 2], [0, 0, 1]]
    text = ("%YAML:1.0\n---\nprojector_width: 640\nprojector_height: 480\n"
            + matrix("projector_matrix", [[900, 0, 320], [0, 900, 240], [0, 0, 1]])
            + matrix("projector_distortion", [[0] * 5]))
    camera = (f'name: "camera"\nwidth: {WIDTH}\nheight: {HEIGHT}\n' + matrix("camera_matrix", camera)
              + matrix("camera_distortion", [[0] * 5]) + matrix("R", np.eye(3)) + matrix("T", [[100], [0], [0]]))
    return text + "cameras:\n   -\n" + re.sub("(?m)^", "      ", camera).rstrip(" ")


def record(folder, clouds, scans=None):
    (folder / "clouds").mkdir(parents=True)
    (folder / "calibration.yml").write_text(calibration(), encoding="utf-8")
    lines = ""
    for i, bytes_ in enumerate(clouds):
        name = f"clouds/{i:08d}.ply"
        (folder / name).write_bytes(bytes_)
        lines += json.dumps({"cloud": name}) + "\n"
    (folder / "scans.jsonl").write_text(lines, encoding="utf-8")
    (folder / "recording.json").write_text(json.dumps({"scans": len(clouds) if scans is None else scans}), encoding="utf-8")
    return folder


def run(*arguments):
    return subprocess.run((PROGRAM, *map(str, arguments)), capture_output=True, text=True, timeout=600, check=False)


def off_truth_mm(points):
    """The object's frame is the rig's at the first cloud, which sees it unturned."""
    at = np.stack([points[axis] for axis in "xyz"], -1).astype(float) - MIDDLE
    slope = np.stack([bumpy_ball(at + 0.01 * axis) - bumpy_ball(at - 0.01 * axis) for axis in np.eye(3)], -1) / 0.02
    return bumpy_ball(at) / np.linalg.norm(slope, axis=1)


class Model(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.clouds = [cloud(bumpy_ball, degrees, degrees) for degrees in range(0, 360, STEP_DEGREES)]
        cls.turning = record(cls.folder / "turning", cls.clouds)
        done = run("--from", cls.turning, "-o", cls.folder / "a.ply", "--json")
        assert done.returncode == 0, done.stderr
        cls.report, cls.messages = json.loads(done.stdout), done.stderr
        cls.points, cls.triangles = mesh_ply((cls.folder / "a.ply").read_bytes())

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

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

    def scanner(self, clouds, errors=(), also=(), **more):
        """A service whose scans give these clouds, the last one again and again. @param errors  by number of the scan  @param also  parameters that a request may have @param more  what it must have"""
        asked = []

        def answer(request):
            if request["method"] == "settings":
                return result(request, calibration=calibration())
            asks = {key: value for key, value in request["params"].items() if key not in also}
            self.assertEqual(asks, {"format": "ply", "density": "pixels", "coordinate_frame": "rig", "stride": 1, "voxel_mm": 0, **more})
            number = len(asked)
            asked.append(request)
            if number in dict(errors):
                error = {"code": -32000, "message": "no frame came", "data": {"name": dict(errors)[number]}}
                return json.dumps({"jsonrpc": "2.0", "id": request["id"], "error": error}).encode() + b"\n"
            body = clouds(number) if callable(clouds) else clouds[min(number, len(clouds) - 1)]
            return result(request, body, scan=f"s-{number}", bytes=len(body), format="ply")
        scanner = Impostor(answer)
        self.addCleanup(scanner.__exit__)
        return scanner, asked

    def test_a_running_scanner_is_followed_until_all_sides_were_seen(self):
        scanner, asked = self.scanner(self.clouds, {4: "frame_dropped"}.items())
        kept = self.folder / "kept"
        done = run("--socket", scanner.path, "--until-closed", "-o", self.folder / "live.ply", "--keep", kept, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        self.assertTrue(report["closed"])
        self.assertEqual(report["refused"], [])
        self.assertEqual(len(report["fused"]), 29)  # of 30 scans one failed; the last looks from 12 degrees off the first
        self.assertIn("left out: no frame came", done.stderr)
        self.assertIn("found the object again", done.stderr)
        self.assertRegex(done.stderr, r"seen \d+ of 360 degrees; missing: \d+ to 360 degrees after the first view")
        self.assertLess(np.quantile(abs(off_truth_mm(mesh_ply((self.folder / "live.ply").read_bytes())[0])), 0.95), 0.13)
        again = run("--from", kept, "-o", self.folder / "again.ply", "--json")
        self.assertEqual(json.loads(again.stdout), report)
        self.assertEqual((self.folder / "again.ply").read_bytes().split(b"end_header")[1],
                         (self.folder / "live.ply").read_bytes().split(b"end_header")[1])

    def preview(self, file):
        """The points of a preview, which lie on the truth and face outward."""
        head, body = file.read_bytes().split(b"end_header\n", 1)
        fields = [(name, {"float": "<f4", "uchar": "u1"}[kind]) for kind, name in re.findall(r"property (\w+) (\w+)", head.decode())]
        points = np.frombuffer(body, np.dtype(fields))
        self.assertEqual(len(points), int(re.search(rb"element vertex (\d+)", head)[1]))
        at = np.stack([points[axis] for axis in "xyz"], -1).astype(float) - MIDDLE
        outward = np.stack([bumpy_ball(at + 0.01 * axis) - bumpy_ball(at - 0.01 * axis) for axis in np.eye(3)], -1)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        normals = np.stack([points["n" + axis] for axis in "xyz"], -1)
        self.assertGreater(np.quantile((normals * outward).sum(axis=1), 0.05), 0.95)
        self.assertLess(np.quantile(abs(off_truth_mm(points)), 0.95), 0.2)
        return points

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

    def test_a_preview_grows_while_the_object_turns(self):
        file, sizes, shown = self.folder / "growing.ply", [], []

        def clouds(_):
            if file.exists():
                sizes.append(len(self.preview(file)))
            # Previews take a tenth of the time, so that a slow one is long the last: the object stops until the next.
            if len(shown) < 15 or (sizes and sizes[-1] > 1.5 * sizes[0]):
                shown.append(self.clouds[min(len(shown), 29)])
            else:
                time.sleep(0.1)
            return shown[-1]
        scanner, _ = self.scanner(clouds)
        done = run("--socket", scanner.path, "--until-closed", "-o", self.folder / "grown.ply", "--preview", file, "--progress")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sizes, sorted(sizes))
        self.assertGreater(sizes[-1], 1.5 * sizes[0])
        previewed = [json.loads(line)["progress"]["previewed"] for line in done.stdout.splitlines() if '"progress"' in line]
        self.assertEqual(previewed[0], 1)

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

    def test_a_turntable_is_scanned_at_each_line(self):
        """Its first step of 30 degrees is more than the tracker follows unaided."""
        views = [coloured(cloud(bumpy_ball, degrees, degrees)) for degrees in range(0, 360, 30)]
        scanner, asked = self.scanner(views, colour=True)
        done = subprocess.run((PROGRAM, "--socket", scanner.path, "--turntable", "--views", "12", "--colour", "-o",
                               self.folder / "t.ply", "--json", "--preview", self.folder / "t_preview.ply"), input="\n" * 12, capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(asked), 12)
        self.assertEqual(len(json.loads(done.stdout)["fused"]), 12)
        self.assertIn("view 11 of 12 is placed; turn by 30 degrees, then press Enter", done.stderr)
        vertices = mesh_ply((self.folder / "t.ply").read_bytes())[0]
        self.assertLess(np.quantile(abs(off_truth_mm(vertices)), 0.95), 0.15)
        preview = self.preview(self.folder / "t_preview.ply")
        for name, level in (("red", 200), ("green", 100), ("blue", 50)):
            for points in (vertices, preview):
                self.assertLess(abs(points[name].astype(int) - level).max(), 2)

    def test_a_session_that_cannot_go_on_writes_the_model_so_far(self):
        scanner, _ = self.scanner(self.clouds[:6], {6: "not_calibrated"}.items())
        done = run("--socket", scanner.path, "-o", self.folder / "so_far.ply", "--json")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no frame came; the model is built from the clouds before that", done.stderr)
        self.assertEqual(len(json.loads(done.stdout)["fused"]), 6)

    def test_a_cloud_that_cannot_be_kept_ends_with_the_model_so_far(self):
        """As on a full disk: a folder is where the sixth cloud should be."""
        kept = self.folder / "full"

        def clouds(number):
            if number == 5:
                (kept / "clouds/00000005.ply").mkdir()
            return self.clouds[number]
        scanner, _ = self.scanner(clouds)
        done = run("--socket", scanner.path, "-o", self.folder / "full.ply", "--keep", kept, "--json")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "00000005.ply.*; the model is built from the clouds before that")
        self.assertEqual(len(json.loads(done.stdout)["fused"]), 5)

    def on_a_disk(self, *arguments, size="", limit_kib=""):
        """A turntable's session of six views, whose folder, also the temporary one, lies on a disk of this size.

        limit_kib  instead: files may grow so large
        """
        scanner, _ = self.scanner(self.clouds)
        disk, after = (tempfile.mkdtemp(dir=self.folder) for _ in range(2))
        command = [*(OWN_MOUNTS if size else ()), "bash", "-c", ON_A_DISK, "bash", PROGRAM, "--socket", scanner.path,
                   "--turntable", "--views", "30", "--json", *arguments]
        done = subprocess.run(command, input="\n" * 6, capture_output=True, text=True, timeout=600, check=False,
                              env={**os.environ, "DISK": disk, "AFTER": after, "TMPDIR": disk, "SIZE": size,
                                   "LIMIT": str(limit_kib)})
        return done, disk, pathlib.Path(after)

    def kept_clouds(self, done, disk, after):
        """The folder that the message names, where it is now."""
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual((after / "model.stl").read_text(encoding="utf-8"), "before\n")
        told = re.findall(r"(?m)^slsd-model: model.stl: cannot write: .*free some space or choose another place; the clouds are kept: "
                          r"then build the model again with --from (.*)$", done.stderr)
        self.assertEqual(len(told), 1, done.stderr)
        folder = after / pathlib.Path(told[0]).relative_to(disk)
        self.assertTrue(set(after.iterdir()) <= {after / "model.stl", after / "model.3mf", folder}, list(after.iterdir()))
        return folder

    def test_a_full_disk_keeps_the_clouds_and_the_file_before(self):
        """A limit on a file's size stands for the full disk: the clouds and the 3MF fit, the STL does not."""
        done, *where = self.on_a_disk("-o", "model.stl", "-o", "model.3mf", "--voxel", "1.5", limit_kib=512)
        folder = self.kept_clouds(done, *where)
        self.assertTrue(zipfile.is_zipfile(where[1] / "model.3mf"))  # one file keeps no other from being written
        again = run("--from", folder, "-o", self.folder / "model_again.stl", "--voxel", "1.5", "--json")
        self.assertEqual((again.returncode, again.stderr), (0, ""))
        self.assertEqual(len(json.loads(again.stdout)["fused"]), 6)
        self.assertGreater((self.folder / "model_again.stl").stat().st_size, 512 << 10)

    def test_a_disk_that_clouds_fill_has_the_model_in_their_place(self):
        """The sixth cloud finds no room on a real full disk, nor would the model, beside the five."""
        if subprocess.run([*OWN_MOUNTS, "true"], stderr=subprocess.DEVNULL, check=False).returncode:
            self.skipTest("this machine gives no mount namespace")
        done, _, after = self.on_a_disk("-o", "model.stl", "--voxel", "2", size="2100k")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "00000005.ply: cannot write: No space .*; the model is built from the clouds before that\n$")
        self.assertEqual(len(json.loads(done.stdout)["fused"]), 5)
        self.assertEqual(list(after.iterdir()), [after / "model.stl"])
        self.assertEqual((after / "model.stl").stat().st_size, 84 + 50 * json.loads(done.stdout)["triangles"])
        # This one would not fit without the clouds, either.
        folder = self.kept_clouds(*self.on_a_disk("-o", "model.stl", "--voxel", "0.5", size="2100k"))
        self.assertEqual(len(list((folder / "clouds").iterdir())), 5)

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

    def test_no_service_and_a_folder_in_use_say_so(self):
        done = run("--socket", self.folder / "none.sock", "-o", self.folder / "none.ply")
        self.assertEqual(done.returncode, 1)
        self.assertIn("none.sock", done.stderr)
        scanner, _ = self.scanner(self.clouds)
        done = run("--socket", scanner.path, "-o", self.folder / "none.ply", "--keep", self.turning)
        self.assertEqual(done.returncode, 1)
        self.assertIn("exists and is not an empty folder", done.stderr)
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

    def test_the_example_prints_a_part(self):
        scanner, asked = self.scanner(self.clouds, also=PYTHON_ASKS)
        example = PACKAGE / "examples/print_part.py"
        done = subprocess.run([sys.executable, example, self.folder / "part.stl", "30"], input="\n" * 30, capture_output=True, text=True, timeout=600,
                              check=False, env={**os.environ, "SLSD_SOCKET": str(scanner.path), "PYTHONPATH": str(PACKAGE),
                                                "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("30 views", done.stdout)
        self.assertEqual(subprocess.run(("assimp", "info", self.folder / "part.stl"), capture_output=True, timeout=300, check=False).returncode, 0)

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
