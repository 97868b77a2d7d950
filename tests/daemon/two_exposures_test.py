#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans with two exposures of each picture, from a folder of frames and again from a bundle."""
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

from service import BIN, SCENE, Service, slsctl, slsd

BRIGHT, DARK, NOISE = 0.9, 0.05, 2


def write_pgm(path, levels):
    pixels = np.clip(np.rint(levels), 0, 255).astype(np.uint8)
    path.write_bytes(b"P5\n%d %d\n255\n" % (pixels.shape[1], pixels.shape[0]) + pixels.tobytes())


class TwoExposures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with Service(camera_path=SCENE / "frame.png") as service, service.client() as client:
            frame, pixels = client.call("frame", format="raw")
        even = np.frombuffer(pixels, np.uint8).reshape(frame["height_px"], frame["width_px"]).astype(float)
        right = np.arange(even.shape[1]) >= even.shape[1] // 2
        cls.levels = even * np.where(right, BRIGHT, DARK)

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def serve(self, exposures=(1, 4), camera="exposures_us = [1000, 4000]\n"):
        """The service, whose camera's images have these exposures in turn."""
        frames = self.folder / ("frames" + "-".join(map(str, exposures)))
        frames.mkdir(exist_ok=True)
        for i, exposure in enumerate(exposures):
            noise = np.random.default_rng(i).normal(0, NOISE, self.levels.shape)
            write_pgm(frames / f"{i}.pgm", self.levels * exposure + noise)
        return Service(camera_path=frames, camera=camera)

    def test_are_merged_and_replayed(self):
        with self.serve(exposures=(1,), camera="") as service, service.client() as client:
            shorter, _ = client.call("scan")
        self.assertNotIn("exposures", shorter)
        with self.serve() as service, service.client() as client:
            scan, cloud = client.call("scan", frames="raw")
            event, pixels = client.events[0]
            client.call("subscribe")
            streamed = client.receive()[0]["params"]
            client.call("unsubscribe")
            slsctl("--socket", service.socket, "bundle", "-o", self.folder / "bundle.tar")
        self.assertEqual(scan["exposures"], {"camera": {"merged": 2}})
        self.assertEqual(streamed["exposures"], scan["exposures"])
        self.assertGreater(scan["points"], shorter["points"] + 100)
        self.assertEqual((event["params"]["bits"], len(pixels)), (16, 2 * self.levels.size))
        # Noise of the longer frame counts a quarter.
        merged = np.frombuffer(pixels, "<u2").reshape(self.levels.shape)[:, :self.levels.shape[1] // 2] / 257
        off = np.abs(merged - self.levels[:, :merged.shape[1]])
        self.assertLess(np.sqrt(np.mean(off ** 2)), 0.35 * NOISE)
        replayed = subprocess.run([BIN / "slsd", "--replay", self.folder / "bundle.tar"], capture_output=True, text=True,
                                  check=False, timeout=120)
        self.assertEqual(replayed.returncode, 0, replayed.stdout + replayed.stderr)
        self.assertIn("the same cloud, byte for byte", replayed.stdout)
        self.assertGreater(len(cloud), 0)

    def test_that_differ_leave_the_shorter_one(self):
        with self.serve(exposures=(1, 1)) as service, service.client() as client:
            scan, _ = client.call("scan")
        told = scan["exposures"]["camera"]
        self.assertEqual(told["merged"], 1)
        self.assertIn("1.00 times as bright as the shorter, not 4.00 times", told["problem"])
        self.assertGreater(scan["points"], 100)

    def test_are_proposed_by_check_if_none_suits(self):
        for exposure, camera, proposed in ((1, "", False), (2, "", True), (2, "exposures_us = [1000, 4000]\n", False)):
            service = self.serve(exposures=(exposure,), camera=camera)
            checked = slsd("--check", "--config", service.file)
            self.assertEqual("set exposures_us to a shorter and a longer exposure" in checked.stdout + checked.stderr,
                             proposed, checked.stdout + checked.stderr)


if __name__ == "__main__":
    unittest.main()
