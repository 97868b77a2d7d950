#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds takes a robot's poses from tf, on loopback. Another maker's DDS publishes them; numpy says where all is."""
import pathlib
import subprocess
import sys
import threading
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "daemon"), str(HERE.parents[2] / "clients/python")]

import numpy as np  # noqa: E402

import robot_frame_test  # noqa: E402
from dds_test import DOMAIN, LOOPBACK, turn  # noqa: E402
from service import BIN, SCENE, Service, slsctl  # noqa: E402

IDENTITY = (0, 0, 0, 1)
BASE = ("tf_static", "world", "base_link", (1.5, -0.3, 0.1), (0.0, 0.0, 0.6, 0.8))
TOOL = ("tf_static", "wrist", "tool0", (0.01, 0.02, 0.15), (0.48, -0.36, 0.64, 0.48))


def arm(place=(0.4, -0.2, 0.6), rotation=(0.5, -0.5, 0.1, 0.7), child="wrist", **stamp):
    rotation = np.array(rotation) / np.linalg.norm(rotation)
    return ("tf", "world", child, place, rotation, stamp.get("ahead_s", 0.0))


def matrix(transform):
    """4x4, mm."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn(transform[4]), 1000 * np.array(transform[3])
    return whole


class Robot:
    """Publishes transforms 50 times a second, and the fixed ones first.

    @param moving  gives them for a time
    """

    def __init__(self, fixed, moving):
        self.process = subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--transforms"], stdin=subprocess.PIPE, text=True)
        self.moving, self.ended = moving, threading.Event()
        self.send(fixed, time.time())
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def send(self, transforms, now):
        for topic, parent, child, place, rotation, *ahead in transforms:
            stamp = round(1e9 * (now + ahead[0])) if ahead and ahead[0] is not None else 0
            self.process.stdin.write(" ".join(map(str, (topic, parent, child, stamp // 10**9, stamp % 10**9, *place, *rotation))) + "\n")
        if transforms:
            self.process.stdin.write("\n")
            self.process.stdin.flush()

    def run(self):
        while not self.ended.wait(0.02):
            now = time.time()
            self.send(self.moving(now), now)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()
        self.process.stdin.close()
        self.process.wait(30)


def printing(*options, flange="tool0"):
    return subprocess.Popen([BIN / "slsd-dds", "--print-pose", "--flange", flange, *LOOPBACK, *options], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def printed(*options, **more):
    out, said = printing(*options, **more).communicate(timeout=120)
    return out, said


class PrintPose(unittest.TestCase):
    def test_of_a_standing_flange_is_what_the_service_takes(self):
        expected = np.linalg.inv(matrix(BASE)) @ matrix(arm()) @ matrix(TOOL)
        with Robot([BASE, TOOL], lambda _: [arm()]):
            out, said = printed()
        self.assertEqual(said, "")
        numbers = [float(each) for each in out.split(",")]
        np.testing.assert_allclose(numbers[:3], expected[:3, 3] / 1000, atol=1e-7)
        np.testing.assert_allclose(turn(numbers[3:]), expected[:3, :3], atol=1e-7)
        service = Service(configuration=robot_frame_test.CONFIGURATION.format(
            scene=SCENE, frame='output = "robot_base"\nhand_eye = "hand_eye.yml"'))
        (service.folder / "hand_eye.yml").write_text(robot_frame_test.hand_eye("arm"), encoding="utf-8")
        cloud = service.folder / "part.ply"
        with service:
            done = slsctl("scan", cloud, "--poses", "ros", f"--robot-pose={out.strip()}", "--socket", service.socket)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        (line,) = [line for line in cloud.read_bytes().split(b"end_header")[0].decode().split("\n") if "base_from_rig" in line]
        told = np.array([float(word) for word in line.split()[2:]]).reshape(3, 4)
        np.testing.assert_allclose(told, (expected @ robot_frame_test.MOUNT)[:3], atol=1e-3)

    def test_of_a_moving_flange_is_refused(self):
        for moving in (lambda now: [arm(place=(0.4, -0.2, 0.6 + 0.002 * (now % 100)))],  # 2 mm/s
                       lambda now: [arm(rotation=(0, 0, np.sin(now % 100 / 500), np.cos(now % 100 / 500)))]):
            with Robot([BASE, TOOL], moving):
                out, said = printed()
            self.assertEqual(out, "")
            self.assertIn('flange_moves: "tool0" moved by ', said)

    def test_is_refused_by_name_if_tf_is_not_sound(self):
        nan = float("nan")
        bad = {  # by the flange's name: what is published of it, and what is said
            "nowhere": ([], 'tf_missing: tf has no frame "nowhere"'),
            "apart": ([("tf", "moon", "apart", (0, 0, 1), IDENTITY, 0.0)], 'tf_unconnected: "apart" hangs on "moon"'),
            "nan": ([("tf", "wrist", "nan", (0, nan, 1), IDENTITY, 0.0)], "has a number that is not finite"),
            "long": ([("tf", "wrist", "long", (0, 0, 1), (0, 0, 1, 1), 0.0)], "has a quaternion of length 1.41 instead of 1"),
            "timeless": ([("tf", "wrist", "timeless", (0, 0, 1), IDENTITY, None)], 'tf_stamp: the transform of "timeless"'),
            "ahead": ([("tf", "wrist", "ahead", (0, 0, 1), IDENTITY, 3.0)], 'tf_future: the transform of "ahead" is stamped 3 s'),
            "old": ([("tf", "wrist", "old", (0, 0, 1), IDENTITY, -60.0)], 'tf_old: the transform of "old" is 60 s old'),
            "late": ([("tf", "wrist", "late", (0, 0, 1), IDENTITY, -2.0)], 'tf_late: the newest pose of "late" is 2'),
            "loop": ([("tf", "loop", "loop2", (0, 0, 1), IDENTITY, 0.0), ("tf", "loop2", "loop", (0, 0, 1), IDENTITY, 0.0)],
                     'tf_loop: tf has a loop: "loop" in "loop2" in "loop"'),
            "twice": ([("tf", "wrist", "twice", (0, 0, 1), IDENTITY, 0.0), ("tf", "world", "twice", (0, 0, 1), IDENTITY, 0.0)],
                      'tf_two_parents: "twice" is placed twice, moving in "wrist" and moving in "world"'),
            "in_mm": ([("tf", "wrist", "in_mm", (0, 0, 150), IDENTITY, 0.0)], 'tf_unreachable: tf puts "in_mm" 1.'),
        }
        for flange, (transforms, message) in bad.items():
            with self.subTest(flange), Robot([BASE, TOOL], lambda _, more=transforms: [arm(), *more]):
                out, said = printed(flange=flange)
                self.assertEqual(out, "")
                self.assertIn(message, said)

    def test_needs_a_flange(self):
        done = subprocess.run([BIN / "slsd-dds", "--print-pose"], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("--print-pose needs --flange", done.stderr)
        out, said = printed(flange="base_link")
        self.assertEqual(out, "")
        self.assertIn("must name two frames", said)


if __name__ == "__main__":
    unittest.main()
