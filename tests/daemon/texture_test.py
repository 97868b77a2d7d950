#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans with frames in white light and in the light of the room alone, replayed from folders."""
import pathlib
import shutil
import struct
import tempfile
import unittest

from client import RpcError
from service import SCENE, Service, slsctl

STRIDE, INTENSITY = 43, 12


def intensities(ply):
    header, body = ply.split(b"end_header\n", 1)
    count = next(int(line.split()[2]) for line in header.decode().split("\n") if line.startswith("element vertex"))
    assert len(body) == count * STRIDE
    return [struct.unpack_from("<B", body, i * STRIDE + INTENSITY)[0] for i in range(count)]


class Texture(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.frames = pathlib.Path(temporary.name) / "frames"
        self.record("", "frame")

    def record(self, folder, *images):
        (self.frames / folder).mkdir(parents=True, exist_ok=True)
        for i, image in enumerate(images):
            shutil.copy(SCENE / (image + ".png"), self.frames / folder / f"{i}.png")

    def serve(self, path=None):
        service = Service(camera_path=path or self.frames).start()
        self.addCleanup(service.__exit__)
        client = service.client()
        self.addCleanup(client.close)
        return service, client

    def test_intensity_is_white_less_dark(self):
        self.record("white", "grey", "white")
        self.record("dark", "dim")
        _, client = self.serve()
        plain, cloud = client.call("scan")
        self.assertNotIn("saturated", plain)
        self.assertIn("camera", plain["light"])
        symbols = intensities(cloud)
        # The first scan's frame had the number 0 of each folder, and this one's is its 1st again: one image loops.
        textured, cloud = client.call("scan", texture=True, ambient=True)
        self.assertGreaterEqual(textured["points"], plain["points"])
        self.assertNotIn("light", textured)
        self.assertEqual((textured["saturated"], set(intensities(cloud))), (textured["points"], {255}))
        _, cloud = client.call("scan", texture=True)
        self.assertEqual(set(intensities(cloud)), {90})
        client.call("scan")
        textured, cloud = client.call("scan", texture=True, ambient=True)
        self.assertEqual((textured["saturated"], set(intensities(cloud))), (0, {60}))
        _, cloud = client.call("scan", ambient=True)
        self.assertEqual(intensities(cloud), [max(0, symbol - 30) for symbol in symbols])

    def test_frames_come_one_to_a_picture(self):
        self.record("white", "grey")
        self.record("dark", "dim")
        _, client = self.serve()
        client.call("scan", texture=True, ambient=True, frames="raw")
        seen = [(event["params"]["light"], event["params"]["frame"], set(pixels)) for event, pixels in client.events]
        self.assertEqual([(light, number) for light, number, _ in seen], [("pattern", 0), ("white", 1), ("dark", 2)])
        self.assertEqual((seen[1][2], seen[2][2]), ({90}, {30}))
        times = [event["params"]["exposure_start_ns"] for event, _ in client.events]
        ends = [event["params"]["received_ns"] for event, _ in client.events]
        for end, start in zip(ends, times[1:]):
            self.assertGreater(start - end, 16e6)  # a whole refresh of the next picture lies between
        self.assertEqual(client.call("status")[0]["cameras"][0]["frames_lost"], 0)

    def test_folders_stand_beside_one_image(self):
        self.record("white", "grey")
        service, _ = self.serve(self.frames / "0.png")
        result = slsctl("--socket", service.socket, "scan", "--texture", "-o", self.frames / "cloud.ply")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(", 0 saturated", result.stdout)
        self.assertEqual(set(intensities((self.frames / "cloud.ply").read_bytes())), {90})

    def test_without_such_frames_the_scan_is_an_error(self):
        self.record("white", "small")
        service, client = self.serve()
        for params, name, words in (({"ambient": True}, "not_found", "folder \"dark\""),
                                    ({"texture": True}, "mismatch", "folder \"white\" is 640x480")):
            with self.assertRaises(RpcError) as caught:
                client.call("scan", **params)
            self.assertEqual(caught.exception.name, name)
            self.assertIn(words, str(caught.exception))
            self.assertGreater(client.call("scan")[0]["points"], 2000)
        result = slsctl("--socket", service.socket, "scan", "--ambient")
        self.assertEqual(result.returncode, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
