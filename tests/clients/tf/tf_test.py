#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds takes a robot's poses from tf, on loopback. Another maker's DDS publishes them; numpy says where all is."""
import pathlib
import re
import subprocess
import sys
import threading
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "daemon"), str(HERE.parents[2] / "clients/python")]

import numpy as np  # noqa: E402

import robot_frame_test  # noqa: E402
import patience  # noqa: E402, F401
import slsd  # noqa: E402
from dds_bridge import DOMAIN, LOOPBACK, RECORD, Bridge, Listener, States, probe, turn  # noqa: E402
from service import BIN, SCENE, Service, slsctl, wait_until  # noqa: E402

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
        self.moving, self.ended, self.sent = moving, threading.Event(), []
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
            transforms = self.moving(now)
            self.sent += [(round(1e9 * now), transforms[0])] if transforms else []
            self.send(transforms, now)

    def pose_at(self, stamp_ns):
        """That of the first transform: linear between its neighbours, and along the great circle."""
        after = next(i for i, (at, _) in enumerate(self.sent) if at >= stamp_ns)
        (begin, first), (end, last) = self.sent[after - 1], self.sent[after]
        share = (stamp_ns - begin) / (end - begin)
        a, b = np.array(first[4]), np.array(last[4])
        b = b if a @ b > 0 else -b
        angle = np.arccos(min(1, a @ b))
        both = ((np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle) if angle > 1e-9 else a)
        return matrix((*first[:3], (1 - share) * np.array(first[3]) + share * np.array(last[3]), both / np.linalg.norm(both)))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.thread.join()
        self.process.stdin.close()
        self.process.wait(600)


def printing(*options, flange="tool0"):
    return subprocess.Popen([BIN / "slsd-dds", "--print-pose", "--flange", flange, *LOOPBACK, *options], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def printed(*options, expected="", **more):
    """Again, if a busy machine stopped the robot for a while, unless that is expected."""
    while True:
        out, said = printing(*options, **more).communicate(timeout=600)
        if (expected and expected in said) or not re.search("tf_gap|tf_late", said):
            return out, said


def service_of(mounted, hand_eye=True):
    """A service with the scanner on the arm or in the cell."""
    frame = 'output = "robot_base"\nhand_eye = "hand_eye.yml"' if hand_eye else ""
    service = Service(configuration=robot_frame_test.CONFIGURATION.format(scene=SCENE, frame=frame))
    (service.folder / "hand_eye.yml").write_text(robot_frame_test.hand_eye(mounted), encoding="utf-8")
    return service


def trigger():
    """What a call of the trigger service answers: whether it scanned, and a message."""
    done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True, text=True, timeout=120,
                          check=True)
    _, _, scanned, message = done.stdout.strip().split(" ", 3)
    return scanned == "1", message


class PrintPose(unittest.TestCase):
    def test_of_a_standing_flange_is_what_the_service_takes(self):
        expected = np.linalg.inv(matrix(BASE)) @ matrix(arm()) @ matrix(TOOL)
        with Robot([BASE, TOOL], lambda _: [arm()]):
            out, said = printed()
        self.assertEqual(said, "")
        numbers = [float(each) for each in out.split(",")]
        np.testing.assert_allclose(numbers[:3], expected[:3, 3] / 1000, atol=1e-7)
        np.testing.assert_allclose(turn(numbers[3:]), expected[:3, :3], atol=1e-7)
        with service_of("arm") as service:
            cloud = service.folder / "part.ply"
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
            "apart": ([("tf", "moon", "apart", (0, 0, 1), IDENTITY, 0.0)], 'tf_unconnected: "apart" descends from "moon"'),
            "nan": ([("tf", "wrist", "nan", (0, nan, 1), IDENTITY, 0.0)], "has a number that is not finite"),
            "long": ([("tf", "wrist", "long", (0, 0, 1), (0, 0, 1, 1), 0.0)], "has a quaternion of length 1.41 instead of 1"),
            "timeless": ([("tf", "wrist", "timeless", (0, 0, 1), IDENTITY, None)], 'tf_stamp: the transform of "timeless"'),
            "ahead": ([("tf", "wrist", "ahead", (0, 0, 1), IDENTITY, 3600.0)], 'tf_future: the transform of "ahead" is stamped '),
            "old": ([("tf", "wrist", "old", (0, 0, 1), IDENTITY, -60.0)], 'tf_old: the transform of "old" is '),
            "late": ([("tf", "wrist", "late", (0, 0, 1), IDENTITY, -2.0)], 'tf_late: the newest pose of "late" is '),
            "loop": ([("tf", "loop", "loop2", (0, 0, 1), IDENTITY, 0.0), ("tf", "loop2", "loop", (0, 0, 1), IDENTITY, 0.0)],
                     'tf_loop: tf has a loop: "loop" in "loop2" in "loop"'),
            "twice": ([("tf", "wrist", "twice", (0, 0, 1), IDENTITY, 0.0), ("tf", "world", "twice", (0, 0, 1), IDENTITY, 0.0)],
                      'tf_two_parents: "twice" is placed twice, moving in "wrist" and moving in "world"'),
            "in_mm": ([("tf", "wrist", "in_mm", (0, 0, 150), IDENTITY, 0.0)], 'tf_unreachable: the pose of "in_mm" in "base_link" puts the flange 1.'),
        }
        for flange, (transforms, message) in bad.items():
            with self.subTest(flange), Robot([BASE, TOOL], lambda _, more=transforms: [arm(), *more]):
                out, said = printed(flange=flange, expected=message)
                self.assertEqual(out, "")
                self.assertIn(message, said)

    def test_needs_a_flange(self):
        done = subprocess.run([BIN / "slsd-dds", "--print-pose"], capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("--print-pose needs --flange", done.stderr)
        out, said = printed(flange="base_link")
        self.assertEqual(out, "")
        self.assertIn("must name two frames", said)


def swinging(now):
    """Half a metre a second, and a radian."""
    phase = 5 * (now % 1000)
    about = 0.2 * np.sin(phase)
    # The sign of a quaternion means nothing: robots change it as they like.
    sign = 1 if int(10 * phase) % 2 else -1
    return [arm(place=(0.4 + 0.1 * np.sin(phase), -0.2, 0.6 + 0.1 * np.cos(phase)),
                rotation=sign * np.array([0.3 * np.sin(about), 0.4 * np.sin(about), np.sqrt(0.75) * np.sin(about), np.cos(about)]))]


class Clouds(unittest.TestCase):
    def test_are_placed_by_the_pose_at_their_exposure(self):
        with service_of("arm") as service, Robot([BASE, TOOL], swinging) as robot, \
                Bridge(service, "--flange", "tool0", "--rate", "5"), slsd.Scanner(service.socket) as scanner:
            samples = probe("left/points", "PointCloud2", "--count", "5", "--seconds", "100")
            rig = scanner.scan(coordinate_frame="rig").points
        self.assertEqual(len(samples), 5)
        places = np.stack([rig[axis].astype(float) for axis in "xyz"], axis=1)
        beyond_ms = []
        for sample in samples:
            cloud = sample.point_cloud()
            self.assertEqual(cloud["header"]["frame_id"], "base_link")
            points = np.frombuffer(cloud["data"], RECORD)
            np.testing.assert_array_equal(points["sigma"], rig["sigma_mm"] / np.float32(1000))
            got = np.stack([points[axis] for axis in "xyz"], axis=1)
            stamp_ns = round(1e9 * cloud["header"]["stamp"])
            beyond_ms.append(stamp_ns % 1_000_000)
            off = lambda at_ns: np.abs(got - self.expected(robot, at_ns, places)).max()  # noqa: E731
            self.assertLess(off(stamp_ns), 2e-5)  # stamps in this test lose a few hundred ns
            self.assertGreater(off(stamp_ns - 30_000_000), 2e-4)
        self.assertTrue(any(1000 < rest < 999_000 for rest in beyond_ms), beyond_ms)  # no whole milliseconds

    def expected(self, robot, stamp_ns, places):
        whole = np.linalg.inv(matrix(BASE)) @ robot.pose_at(stamp_ns) @ matrix(TOOL) @ robot_frame_test.MOUNT
        return (places @ whole[:3, :3].T + whole[:3, 3]) / 1000

    def test_are_not_published_without_a_pose_and_are_once_it_is_there(self):
        with service_of("arm") as service, Bridge(service, "--flange", "tool0", "--rate", "5") as bridge, States() as states, \
                Listener("left/points", "PointCloud2") as clouds:
            def problem():
                return states.samples.get("left: slsd", {"message": ""})["message"]

            wait_until(lambda: problem() == 'the last cloud is not published: tf_missing: tf has no frame "base_link"', "what is missing")
            self.assertEqual(trigger(), (False, 'tf_missing: tf has no frame "base_link"'))
            with Robot([BASE, TOOL], lambda _: [(*arm()[:5], -2.0)]):
                wait_until(lambda: "tf_late: the newest transform of \"wrist\"" in problem(), "that poses are late")
                self.assertFalse(trigger()[0])
            self.assertEqual(clouds.count, 0)
            with Robot([BASE, TOOL], lambda _: [arm()]):
                wait_until(lambda: clouds.count > 0, "a cloud")
                wait_until(lambda: problem() == "ready to scan", "that all is well")
                wait_until(lambda: re.match(r"\d+ points, scan ", trigger()[1]), "a scan")
            self.assertEqual(bridge.said().count("the last cloud is not published: tf_missing"), 1)

    def test_are_not_published_if_two_place_the_flange(self):
        with service_of("arm") as service, Robot([BASE, TOOL], swinging), Robot([], swinging), \
                Bridge(service, "--flange", "tool0", "--rate", "0"):
            wait_until(lambda: "tf_two_parents" in trigger()[1], "that both are known")
            scanned, message = trigger()
        self.assertFalse(scanned)
        self.assertIn('tf_two_parents: "wrist" is placed twice', message)

    def test_of_a_scanner_without_a_hand_eye_calibration_are_not_published(self):
        with service_of("arm", hand_eye=False) as service, Robot([BASE, TOOL], swinging), \
                Bridge(service, "--flange", "tool0", "--rate", "0"):
            scanned, message = trigger()
        self.assertFalse(scanned)
        self.assertIn("hand_eye_missing", message)

    def test_of_a_scanner_in_the_cell_need_no_pose(self):
        with service_of("cell") as service, Bridge(service, "--flange", "tool0", "--rate", "5"), \
                slsd.Scanner(service.socket) as scanner:
            cloud = probe("left/points", "PointCloud2")[0].point_cloud()
            expected = scanner.scan().points
        self.assertEqual(cloud["header"]["frame_id"], "base_link")
        np.testing.assert_array_equal(np.frombuffer(cloud["data"], RECORD)["x"], expected["x"] / np.float32(1000))


if __name__ == "__main__":
    unittest.main()
