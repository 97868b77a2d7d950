#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsctl datasheet: figures from clouds that numpy made and evaluates again, and a session at the terminal with the
service, which looks at a wall."""
import json
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest

import numpy

from service import BIN, Service, slsctl

SIGMA = 0.04
HEADER = """ply
format binary_little_endian 1.0
comment coordinate_frame rig: the first camera's, x right, y down, z forward
element vertex {}
property float x
property float y
property float z
property float sigma_mm
property uchar intensity
property uchar camera
end_header
"""
RECORD = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma", "<f4"), ("intensity", "u1"), ("camera", "u1")]


def rays():
    y, x = numpy.mgrid[0:300, 0:400]
    away = numpy.stack([(x - 199.5) / 500, (y - 149.5) / 500, numpy.ones_like(x, float)], -1).reshape(-1, 3)
    return away / numpy.linalg.norm(away, axis=1)[:, None]


RAYS = rays()


def to_sphere(centre, radius):
    along = RAYS @ centre
    inside = radius**2 - (centre @ centre - along**2)
    return numpy.where(inside < 0, numpy.inf, along - numpy.sqrt(numpy.maximum(inside, 0)))


def write(path, distance, random):
    points = RAYS * (distance + random.normal(0, SIGMA, len(RAYS)))[:, None]
    records = numpy.zeros(len(points), RECORD)
    records["x"], records["y"], records["z"] = points.T
    records["sigma"] = SIGMA
    path.write_bytes(HEADER.format(len(points)).encode() + records.tobytes())
    return numpy.stack([records[name] for name in "xyz"], 1).astype(float)


def within(distances):
    """The distances without the farthest three in a thousand."""
    kept = len(distances) - int(0.003 * len(distances))
    return distances[numpy.argsort(numpy.abs(distances))[:kept]]


def fitted_sphere(points, centre, radius):
    for _ in range(30):
        out = points - centre
        length = numpy.linalg.norm(out, axis=1)
        slopes = numpy.column_stack([-out / length[:, None], -numpy.ones(len(points))])
        change = numpy.linalg.lstsq(slopes, -(length - radius), rcond=None)[0]
        centre, radius = centre + change[:3], radius + change[3]
    return centre, radius


def cap(points, centre, radius):
    out = points - centre
    towards = -out @ centre / numpy.linalg.norm(out, axis=1) / numpy.linalg.norm(centre)
    return points[(towards >= 0.5) & (numpy.abs(numpy.linalg.norm(out, axis=1) - radius) < 8 * SIGMA)]


class Datasheet(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def sheet(self, *words):
        done = slsctl("--json", "datasheet", self.folder, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return {each["name"]: each for each in json.loads(done.stdout)["quantities"]}

    def test_figures_are_those_of_numpy(self):
        random = numpy.random.default_rng(11)
        flatness, form, size = [], [], []
        for i in range(1, 4):
            normal = numpy.array([0.2 * i - 0.4, 0.1, 1])
            normal /= numpy.linalg.norm(normal)
            points = write(self.folder / f"plate-{i:02}.ply", 500 / (RAYS @ normal), random)
            for _ in range(2):
                axes = numpy.linalg.svd(points - points.mean(0), full_matrices=False)[2]
                off = (points - points.mean(0)) @ axes[2]
                points = points[numpy.argsort(numpy.abs(off))[: len(off) - (int(0.003 * len(off)) if _ == 0 else 0)]]
            flatness.append(numpy.ptp((points - points.mean(0)) @ axes[2]))
            centre = numpy.array([60.0 * i - 120, 20, 560])
            points = cap(write(self.folder / f"sphere-{i:02}.ply", numpy.minimum(to_sphere(centre, 30.03), 900 / RAYS[:, 2]), random), centre, 30.03)
            middle, radius = fitted_sphere(points, centre, 30)
            off = numpy.linalg.norm(points - middle, axis=1) - radius
            points = points[numpy.argsort(numpy.abs(off))[: len(within(off))]]
            middle, radius = fitted_sphere(points, middle, radius)
            form.append(numpy.ptp(numpy.linalg.norm(points - middle, axis=1) - radius))
            size.append(2 * radius - 60)
        found = self.sheet("--diameter-mm", "60")
        numpy.testing.assert_allclose(found["Flatness"]["values"], flatness, atol=1e-4)
        numpy.testing.assert_allclose(found["Probing error, form"]["values"], form, atol=0.02)
        numpy.testing.assert_allclose(found["Probing error, size"]["values"], size, atol=0.01)
        self.assertAlmostEqual(found["Plate: error over sigma"]["mean"], 1, delta=0.03)
        self.assertEqual(found["Flatness"]["worst"], max(found["Flatness"]["values"]))
        self.assertAlmostEqual(found["Flatness"]["high"] - found["Flatness"]["mean"], 4.303 * numpy.std(flatness, ddof=1) / 3**0.5, delta=1e-4)
        self.assertTrue((self.folder / "datasheet.pdf").read_bytes().startswith(b"%PDF"))

    def test_spacing_of_a_bar_and_its_uncertainty(self):
        random = numpy.random.default_rng(12)
        for i in range(1, 3):
            along = numpy.array([1, 0.3 * i, 0.2])
            along *= 75.1 / numpy.linalg.norm(along)
            middle = numpy.array([0, 0, 560.0])
            write(self.folder / f"bar-{i}.ply", numpy.minimum(numpy.minimum(to_sphere(middle + along, 20), to_sphere(middle - along, 20)), 900 / RAYS[:, 2]), random)
        narrow, wide = (self.sheet("--diameter-mm", "40", "--spacing-mm", "150", "--uncertainty-mm", each)["Sphere spacing error"] for each in ("0", "0.5"))
        numpy.testing.assert_allclose(narrow["values"], 0.2, atol=0.02)
        self.assertGreater(wide["high"] - wide["mean"], 0.5)
        done = slsctl("datasheet", self.folder, "--diameter-mm", "40", "--spacing-mm", "190")
        self.assertEqual(done.returncode, 1)
        self.assertIn("bar-1.ply: two spheres are 150.2 mm apart, but the bar's should be 190 mm apart", done.stderr)

    def test_a_session_at_the_terminal(self):
        with Service() as service:
            words = [BIN / "slsctl", "--socket", str(service.socket), "datasheet", str(self.folder), "--plate", "2", "--note", "20.5 degrees"]
            done = subprocess.run(words, input="\n", capture_output=True, text=True, timeout=600)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("plate, place 1 of 2: put the flat plate at a new place", done.stderr)
            self.assertIn("the input ended before plate-02.ply: the same command continues from there", done.stderr)
            self.assertFalse((self.folder / "datasheet.pdf").exists())
            done = subprocess.run(words, input="\n", capture_output=True, text=True, timeout=600)  # the second place
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertNotIn("place 1 of 2", done.stderr)
            self.assertRegex(done.stdout, r"Flatness +2 places  worst \+0\.\d+ mm")
            self.assertEqual({each.name for each in self.folder.iterdir()}, {"plate-01.ply", "plate-02.ply", "datasheet.pdf"})
            ball = [*words[:5], "--sphere", "1", "--diameter-mm", "30"]
            done = subprocess.run(ball, input="\n", capture_output=True, text=True, timeout=600)  # the wall is no sphere
            self.assertEqual(done.returncode, 1)
            self.assertIn("no sphere of 30 mm is visible", done.stderr)
            if shutil.which("pdftotext"):
                text = subprocess.run(["pdftotext", self.folder / "datasheet.pdf", "-"], capture_output=True, text=True, check=True).stdout
                self.assertIn("20.5 degrees", text)
                about = subprocess.run(["pdfinfo", self.folder / "datasheet.pdf"], capture_output=True, text=True, check=True).stdout
                self.assertRegex(about, r"Pages: +1\n")

    def test_what_is_wrong_is_named(self):
        empty = slsctl("datasheet", self.folder)
        self.assertEqual(empty.returncode, 1)
        self.assertIn("has no plate-01.ply, sphere-01.ply or bar-01.ply", empty.stderr)
        (self.folder / "sphere-01.ply").write_bytes(b"ply\n")
        other = slsctl("datasheet", self.folder, "--diameter-mm", "30")
        self.assertIn("sphere-01.ply: is not a cloud that slsd wrote as PLY", other.stderr)
        write(self.folder / "sphere-01.ply", 900 / RAYS[:, 2], numpy.random.default_rng(1))
        self.assertIn("sphere-01.ply: needs the artefact's size: add --diameter-mm", slsctl("datasheet", self.folder).stderr)
        for words, text in ((("--sphere", "3"), "--diameter-mm is missing"), (("--bar", "3", "--diameter-mm", "9"), "--spacing-mm is missing"),
                            (("--bar", "3", "--diameter-mm", "90", "--spacing-mm", "80"), "--spacing-mm must be more than --diameter-mm"),
                            (("--plate", "0"), "--plate"), (("--ball-bar", "x.stl", "--diameter-mm", "9", "--spacing-mm", "80"), "--ball-bar takes no FOLDER")):
            done = slsctl("datasheet", self.folder, *words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(text, done.stderr)
        self.assertIn("FOLDER is missing", slsctl("datasheet").stderr)
        done = slsctl("--socket", self.folder / "none.sock", "datasheet", self.folder / "new", "--plate", "1")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertFalse((self.folder / "new").exists())

    def test_a_bar_to_print(self):
        done = slsctl("datasheet", "--ball-bar", self.folder / "bar.stl", "--diameter-mm", "40", "--spacing-mm", "200")
        self.assertEqual(done.returncode, 0, done.stderr)
        data = (self.folder / "bar.stl").read_bytes()
        count = struct.unpack_from("<I", data, 80)[0]
        self.assertEqual(len(data), 84 + 50 * count)
        triangles = numpy.frombuffer(data, [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")], count, 84)["v"].astype(float)
        numpy.testing.assert_allclose(numpy.ptp(triangles.reshape(-1, 3), axis=0), [240, 40, 40], atol=0.2)
        volume = (numpy.cross(triangles[:, 0], triangles[:, 1]) * triangles[:, 2]).sum() / 6
        self.assertGreater(volume, 2 * 4 / 3 * numpy.pi * 20**3)


if __name__ == "__main__":
    unittest.main(verbosity=2)
