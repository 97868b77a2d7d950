#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Several scanners of one cell: where they stand is measured by the frames of two that were rendered, with the truth beside
them, and their clouds are merged."""
import contextlib
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

from seam import CELL, SCANNERS, measure_extrinsics, placed, read_extrinsics, service, steps_at_seam
import slsd
from service import BIN, wait_until

HAS_DDS = (BIN / "slsd-dds").exists()
if HAS_DDS:
    from dds_bridge import DOMAIN, Bridge, Listener, States

SEAM_MM = 0.5  # at 2 m
FIELDS = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("sigma", 12, 7, 1), ("intensity", 16, 7, 1), ("camera", 20, 2, 1),
          ("scanner", 21, 2, 1)]
RECORD = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma", "<f4"), ("intensity", "<f4"), ("camera", "u1"),
                   ("scanner", "u1"), ("padding", "u1", 2)])


def xyz(points):
    return np.stack([points[axis] for axis in "xyz"], axis=1).astype(float)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def services(self, frames, names=SCANNERS):
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        return {name: stack.enter_context(service(CELL, "left" if name == "third" else name, frames)) for name in names}


class Extrinsics(Folder):
    def test_are_those_of_the_truth_with_errors_of_the_size_that_they_say(self):
        file = self.folder / "cell.toml"
        done = measure_extrinsics(self.services("board"), file, 2)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("60 corners", done.stdout)
        text = file.read_text(encoding="utf-8")
        self.assertEqual(text.count('calibration_date = "2026-01-31T12:00:00Z"'), 2)
        sigma, far = (float(text.split(key + " = ")[1].split()[0]) for key in ("sigma_mm", "sigma_far_mm"))
        measured, truth = read_extrinsics(file, "right"), read_extrinsics(CELL / "truth.toml", "right")
        corners = np.array([[x, y, 1950] for x in (-150.0, 250) for y in (-120.0, 120)])
        seen = (corners - truth[1]) @ truth[0]  # in the frame of the right one
        self.assertLess(np.linalg.norm(placed(seen, measured) - corners, axis=1).max(), min(0.2, 4 * far))
        self.assertLess(np.linalg.norm((placed(seen, measured) - corners).mean(axis=0)), 4 * sigma)

    def test_of_a_scanner_that_sees_no_board_are_not_made_up(self):
        services = self.services("board") | {"third": self.services("scene", ["third"])["third"]}
        done = measure_extrinsics(services, self.folder / "cell.toml", 2)
        self.assertEqual(done.returncode, 1)
        self.assertIn("third: not used", done.stdout)
        self.assertIn("third: shares no place of the board with the first scanner", done.stderr)
        self.assertFalse((self.folder / "cell.toml").exists())

    def test_without_two_who_see_the_board_are_refused(self):
        done = measure_extrinsics(self.services("scene"), self.folder / "cell.toml", 1)
        self.assertEqual(done.returncode, 1)
        self.assertIn("does not count", done.stdout)
        self.assertIn("extrinsics_missing", done.stderr)

    def test_name_what_is_wrong_with_the_command(self):
        one = {"left": self.services("board", ["left"])["left"]}
        for more, reason in (([], "two scanners"), (["--scanner", "left=x"], "no service answers"),
                             (["--scanner", "right"], "NAME=SOCKET"), (["--scanner", "a.b=x"], "NAME=SOCKET"),
                             (["--scanner", f"left={one['left'].socket}"], "given twice")):
            done = measure_extrinsics(one, self.folder / "cell.toml", 1, *more)
            self.assertEqual(done.returncode, 1)
            self.assertIn(reason, done.stderr)


@unittest.skipUnless(HAS_DDS, "slsd-dds was not built")
class Merged(Folder):
    def merge(self, extrinsics, *more, **options):
        return Bridge(None, "--merge", "--extrinsics", str(extrinsics), *more, name=options.get("name", "merged"))

    @contextlib.contextmanager
    def foreign(self, name, *header):
        """Another program that publishes clouds under this name."""
        other = subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--write", f"{name}/points", "--seconds", "600",
                                  *self.header_of(name, header)], stdin=subprocess.PIPE, text=True)
        try:
            yield other
        finally:
            other.terminate()
            other.wait(600)
            other.stdin.close()

    def header_of(self, name, header=()):
        return [*([] if "--frame" in header else ["--frame", f"{name}_optical_frame"]), *header]

    def write_with(self, other, name, header=()):
        """The clouds to come have another header."""
        other.stdin.write(" ".join(self.header_of(name, header)) + "\n")
        other.stdin.flush()

    def points(self, message):
        self.assertEqual([tuple(field) for field in message["fields"]], FIELDS)
        self.assertEqual((message["header"]["frame_id"], message["point_step"], message["is_dense"]), ("cell", 24, 1))
        return np.frombuffer(message["data"], RECORD)

    def setUp(self):
        super().setUp()
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        self.states = stack.enter_context(States())
        self.clouds = stack.enter_context(Listener("merged/points", "PointCloud2"))

    def wait_state(self, text, what):
        """Until the merging node says this of itself: an empty text where all is well."""
        def said():
            state = self.states.samples.get("merged: slsd merge")
            return state and (text in state["message"] if text else state["level"] == 0)

        wait_until(said, what)

    def sources(self):
        """The scanners of the next merged clouds."""
        self.clouds.next()
        return set(self.points(self.clouds.next().point_cloud())["scanner"])

    def test_is_of_both_in_one_frame_without_a_step_at_the_seam(self):
        boards = self.services("board")
        file = self.folder / "cell.toml"
        self.assertEqual(measure_extrinsics(boards, file, 2).returncode, 0)
        scenes = self.services("scene")
        clouds = {}
        for name, scene in scenes.items():
            with slsd.Scanner(scene.socket) as scanner:
                clouds[name] = scanner.scan(density="pixels", timeout_s=60).points
        truth = read_extrinsics(CELL / "truth.toml", "right")
        expected = {"left": xyz(clouds["left"]), "right": placed(xyz(clouds["right"]), truth)}
        with Bridge(scenes["left"], "--rate", "0", "--density", "pixels", "--stride", "1", name="left"), \
                Bridge(scenes["right"], "--rate", "0", "--density", "pixels", "--stride", "1", name="right"), self.merge(file):
            self.wait_state("no cloud yet", "the merging node")
            done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "merged"], capture_output=True, text=True,
                                  timeout=120, check=True)
            self.assertRegex(done.stdout, r"^1122334455667788 42 1 \d+ points of 2 scanners")
            wait_until(lambda: self.clouds.count > 0, "the merged cloud")
            merged = self.points(self.clouds.samples[""].point_cloud())
        self.assertEqual(len(merged), len(expected["left"]) + len(expected["right"]))
        parts = [merged[merged["scanner"] == i] for i in range(2)]  # by their names
        np.testing.assert_allclose(1000 * xyz(parts[0]), expected["left"], atol=1e-3)
        np.testing.assert_array_equal(parts[1]["sigma"], clouds["right"]["sigma_mm"] / np.float32(1000))
        off = np.linalg.norm(1000 * xyz(parts[1]) - expected["right"], axis=1)
        self.assertLess(off.max(), SEAM_MM)
        steps = steps_at_seam(1000 * xyz(parts[0]), 1000 * xyz(parts[1]))
        self.assertGreater(len(steps), 2000)
        self.assertLess(abs(np.median(steps)), 0.2)

    def test_goes_on_without_one_that_vanished_and_says_so(self):
        scenes = self.services("scene")
        with Bridge(scenes["left"], "--rate", "5", name="left"), self.merge(CELL / "truth.toml", "--max-age", "2"):
            with Bridge(scenes["right"], "--rate", "5", name="right"):
                self.wait_state("", "both")
                self.assertEqual(self.sources(), {0, 1})
            self.wait_state("right: no longer sends clouds", "that it is gone")
            self.assertEqual(self.sources(), {0})
            with Bridge(scenes["right"], "--rate", "5", name="right"):
                self.wait_state("", "both again")

    def test_leaves_out_what_stands_elsewhere_by_now(self):
        scenes = self.services("scene")
        file = self.folder / "cell.toml"
        good = CELL.joinpath("truth.toml").read_text(encoding="utf-8") + 'calibration_date = "2026-01-31T12:00:00Z"\n'
        file.write_text(good, encoding="utf-8")
        with Bridge(scenes["left"], "--rate", "5", name="left"), Bridge(scenes["right"], "--rate", "5", name="right"), \
                self.merge(file):
            self.wait_state("", "both")
            file.write_text(good.replace("2026-01-31", "2025-01-31"), encoding="utf-8")  # it was calibrated anew since
            self.wait_state("right: extrinsics_stale", "that they are stale")
            self.assertEqual(self.sources(), {0})
            file.write_text("nonsense", encoding="utf-8")
            self.wait_state("stay in force", "that the file is broken")
            file.unlink()
            self.wait_state("extrinsics_missing", "that the file is gone")
            file.write_text(good, encoding="utf-8")
            self.wait_state("", "both again")

    def test_leaves_out_two_of_one_name(self):
        scenes = self.services("scene")
        with Bridge(scenes["left"], "--rate", "5", name="left"), Bridge(scenes["right"], "--rate", "5", name="right"), \
                self.merge(CELL / "truth.toml"):
            self.wait_state("", "both")
            with self.foreign("right"):
                self.wait_state("right: name_taken", "that the name is taken")
                self.assertEqual(self.sources(), {0})
            self.wait_state("", "both again")

    def test_believes_no_cloud_whose_header_lies(self):
        lies = (["--width", "101"], ["--height", "2"], ["--width", "4294967295", "--height", "4294967295"], ["--bytes", "1999"],
                ["--point-step", "11", "--row-step", "1100"], ["--x-offset", "17"], ["--x-offset", "4294967295"], ["--big-endian"],
                ["--frame", "map"], ["--row-step", "1999"], ["--width", "0", "--height", "4294967295", "--row-step", "4294967295"])
        with self.foreign("left"), self.merge(CELL / "truth.toml") as merge:
            self.wait_state("right: no cloud yet", "the honest one")
            with self.foreign("right") as other:
                for lie in lies:
                    self.write_with(other, "right")
                    self.wait_state("", "an honest one")
                    with self.subTest(lie=lie):
                        self.write_with(other, "right", lie)
                        self.wait_state("right: cloud_malformed", "that it is not believed")
                        self.assertIsNone(merge.process.poll())
                        self.clouds.next()
                        message = self.clouds.next().point_cloud()
                        self.assertEqual((message["width"], set(self.points(message)["scanner"])), (100, {0}))

    def test_is_refused_without_extrinsics(self):
        alone = self.folder / "alone.toml"
        alone.write_text(CELL.joinpath("truth.toml").read_text(encoding="utf-8").split("[scanner.right]")[0], encoding="utf-8")
        for more, reason in ((["--extrinsics", alone], "fewer than two"),
                             (["--extrinsics", self.folder / "none.toml"], "extrinsics_missing"), ([], "extrinsics_missing"),
                             (["--extrinsics", alone, "--scanner", "left", "--scanner", "right"], "no [scanner.right]")):
            done = subprocess.run([BIN / "slsd-dds", "--merge", "--domain", str(DOMAIN), "--interface", "lo", "--peer", "127.0.0.1",
                                   *map(str, more)], capture_output=True, text=True, timeout=600, check=False)
            self.assertIn(done.returncode, (1, 2))
            self.assertIn(reason, done.stderr)


if __name__ == "__main__":
    unittest.main()
