# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A bumpy ball that turns, in clouds and recordings that numpy computes, and what tests of slsd-model share."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "clients/python"
sys.path[:0] = [str(HERE.parent / "daemon"), str(PACKAGE)]

import numpy as np  # noqa: E402

from impostor import Impostor, result  # noqa: E402

PROGRAM = pathlib.Path(os.environ["SLSD_BIN"]) / "slsd-model"
WIDTH, HEIGHT, FOCUS = 220, 200, 1000.0
MIDDLE = np.array([0, 0, 600.0])
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


class TurningBall(unittest.TestCase):
    """Has the clouds of a full turn, and a recording of them."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.clouds = [cloud(bumpy_ball, degrees, degrees) for degrees in range(0, 360, STEP_DEGREES)]
        cls.turning = record(cls.folder / "turning", cls.clouds)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

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
