#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-model with a running scanner: how it follows an object, and what it keeps if a scan, a disk or a folder fails."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

import numpy as np

from turning_ball import PACKAGE, PROGRAM, TurningBall, bumpy_ball, cloud, coloured, off_truth_mm, run
from mesh_test import mesh_ply

# Runs a program in a folder, on a disk of its own or under a limit, and copies what it left.
ON_A_DISK = """[ -z "$SIZE" ] || mount -t tmpfs -o "size=$SIZE" none "$DISK" || exit
cd "$DISK" && echo before > model.stl || exit
([ -z "$LIMIT" ] || ulimit -f "$LIMIT"; trap "" XFSZ; exec "$@"); status=$?
cp -r . "$AFTER"; exit $status"""
OWN_MOUNTS = ("unshare", "--mount", "--map-root-user")
PYTHON_ASKS = ("transport", "timeout_ms", "normals", "texture", "ambient", "picture", "why")


class LiveModel(TurningBall):
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

    def test_no_service_and_a_folder_in_use_say_so(self):
        done = run("--socket", self.folder / "none.sock", "-o", self.folder / "none.ply")
        self.assertEqual(done.returncode, 1)
        self.assertIn("none.sock", done.stderr)
        scanner, _ = self.scanner(self.clouds)
        done = run("--socket", scanner.path, "-o", self.folder / "none.ply", "--keep", self.turning)
        self.assertEqual(done.returncode, 1)
        self.assertIn("exists and is not an empty folder", done.stderr)
        self.assertFalse((self.folder / "none.ply").exists())

    def test_the_example_prints_a_part(self):
        scanner, asked = self.scanner(self.clouds, also=PYTHON_ASKS)
        example = PACKAGE / "examples/print_part.py"
        done = subprocess.run([sys.executable, example, self.folder / "part.stl", "30"], input="\n" * 30, capture_output=True, text=True, timeout=600,
                              check=False, env={**os.environ, "SLSD_SOCKET": str(scanner.path), "PYTHONPATH": str(PACKAGE),
                                                "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("30 views", done.stdout)
        self.assertEqual(subprocess.run(("assimp", "info", self.folder / "part.stl"), capture_output=True, timeout=300, check=False).returncode, 0)


if __name__ == "__main__":
    unittest.main()
