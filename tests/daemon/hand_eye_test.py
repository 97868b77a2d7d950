#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsctl hand-eye --pose, view by view, with a service whose camera sees drawn boards. The robot is in numpy."""
import atexit
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy

from service import BIN, SCENE, Service, slsctl

VIEWS = 10
CONFIGURATION = """
[projector]
width_px = 640
height_px = 400
[[camera]]
name = "camera"
driver = "file"
path = "frames"
loop = false
[calibration]
file = "{folder}/calibration.yml"
[scan]
projector_latency_ms = 0.0
[server]
socket = "slsd.sock"
"""


def turn(axis, angle):
    x, y, z = numpy.array(axis) / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross


def motion(rotation, place):
    matrix = numpy.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, place
    return matrix


def angle_of(rotation):
    return numpy.arccos(numpy.clip((numpy.trace(rotation) - 1) / 2, -1, 1))


def kuka(matrix, unit=1.0):
    r = matrix[:3, :3]
    angles = (numpy.arctan2(r[1, 0], r[0, 0]), numpy.arctan2(-r[2, 0], numpy.hypot(r[0, 0], r[1, 0])), numpy.arctan2(r[2, 1], r[2, 2]))
    return [*(unit * matrix[:3, 3]), *numpy.degrees(angles)]


def from_kuka(numbers):
    a, b, c = numpy.radians(numbers[3:])
    return motion(turn((0, 0, 1), a) @ turn((0, 1, 0), b) @ turn((1, 0, 0), c), numbers[:3])


FLANGE_FROM_RIG = motion(turn((0.2, -0.1, 1), 0.7), (60, -35, 110))
BASE_FROM_BOARD = motion(turn((1, 0.3, -0.2), 2.1), (900, 200, 50))


def matrix_of(file, name):
    """A matrix of a file in OpenCV's YAML."""
    text = file.read_text(encoding="utf-8")
    numbers = text.split(f"{name}:", 1)[1].split("data: [", 1)[1].split("]", 1)[0]
    return numpy.array([float(word) for word in numbers.split(",")])


class HandEye(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        atexit.register(shutil.rmtree, cls.folder, ignore_errors=True)
        subprocess.run([BIN / "make_views", cls.folder, str(VIEWS)], check=True, timeout=300)
        camera_from_board = numpy.loadtxt(cls.folder / "views.csv", delimiter=",").reshape(-1, 4, 4)
        cls.poses = [BASE_FROM_BOARD @ numpy.linalg.inv(each) @ numpy.linalg.inv(FLANGE_FROM_RIG) for each in camera_from_board]

    def service_seeing(self, *views):
        """A service whose camera sees these views, one after the other; None: no board."""
        service = Service(configuration=CONFIGURATION.format(folder=self.folder))
        frames = service.folder / "frames"
        frames.mkdir()
        for i, view in enumerate(views):
            if view is None:
                (frames / f"{i:02}.pgm").write_bytes(b"P5 800 600 255\n" + bytes(800 * 600))
            else:
                shutil.copy(self.folder / f"pose_{view:02}/white.png", frames / f"{i:02}.png")
        self.captures = service.folder / "captures"
        return service

    def hand_eye(self, service, numbers, *words, options=()):
        pose = ",".join(f"{number:.6f}" for number in numbers)
        return slsctl(*options, "--socket", service.socket, "hand-eye", "--mounted", "arm", "--poses", "kuka", "--from", self.captures,
                      f"--pose={pose}", *words)

    def files(self):
        return {each.relative_to(self.captures): each.read_bytes() for each in self.captures.rglob("*") if each.is_file()}

    def refused(self, done, reason):
        self.assertEqual((done.returncode, done.stdout.count("written")), (1, 0), done.stdout)
        self.assertRegex(done.stderr, r"\Aslsctl: ")
        self.assertRegex(done.stderr, reason)
        self.assertEqual(self.files(), self.before)

    def test_from_the_first_view_to_the_file(self):
        with self.service_seeing(*range(VIEWS)) as service:
            self.assertIn("2 poses are too few", [self.hand_eye(service, kuka(pose)) for pose in self.poses[:2]][1].stdout)
            self.assertFalse((self.captures / "hand_eye.yml").exists())
            errors = []
            for i in range(2, VIEWS):
                done = self.hand_eye(service, kuka(self.poses[i]), options=["--json"])
                self.assertEqual(done.returncode, 0, done.stderr)
                told = json.loads(done.stdout)
                self.assertEqual(told["poses"], i + 1)
                if "next_pose" in told:
                    self.check_next(from_kuka(told["next_pose"]))
                if "file" in told:
                    errors.append(told["error_mm"])
            self.assertLess(errors[-1], errors[0])
        file = self.captures / "hand_eye.yml"
        place = matrix_of(file, "flange_from_rig_T") - FLANGE_FROM_RIG[:3, 3]
        rotation = matrix_of(file, "flange_from_rig_R").reshape(3, 3).T @ FLANGE_FROM_RIG[:3, :3]
        self.assertLess(numpy.linalg.norm(place), 1.5)
        self.assertLess(angle_of(rotation), 1e-3)
        self.assertEqual((self.captures / "poses.csv").read_text(encoding="utf-8").count("\n"), VIEWS)

    def check_next(self, base_from_flange):
        """Of the proposed pose, the board is in the middle of the picture, near the working distance."""
        rig_from_board = numpy.linalg.inv(base_from_flange @ FLANGE_FROM_RIG) @ BASE_FROM_BOARD
        middle = (rig_from_board @ (210, 150, 0, 1))[:3]
        self.assertLess(numpy.hypot(middle[0], middle[1]), 0.03 * middle[2])
        self.assertTrue(1200 < middle[2] < 2600, middle)

    def test_bad_input_has_one_message_and_changes_nothing(self):
        late = self.poses[3] @ motion(turn((1, 2, 0), 0.06), (25, -12, 8))  # the robot had not arrived
        with self.service_seeing(0, 1, 2, 3, 4, 4, None, 4) as service:
            for pose in self.poses[:4]:
                self.assertEqual(self.hand_eye(service, kuka(pose)).returncode, 0)
            self.before = self.files()
            good = kuka(self.poses[4])
            self.refused(self.hand_eye(service, [*good[:5], float("nan")]), "has a number that is not finite")
            self.refused(self.hand_eye(service, [*good, 0.0]), "has 7 numbers instead of 6: x y z in mm, A B C in degrees")
            self.refused(self.hand_eye(service, kuka(self.poses[4], 0.001)), r"pose_04 contradicts the others.*\n.*pose_04 is not kept\n\Z")
            self.refused(self.hand_eye(service, kuka(late)), r"pose_04 contradicts the others.*\n.*pose_04 is not kept\n\Z")
            self.refused(self.hand_eye(service, good), r"pose_04: .*board.*\n.*pose_04 is not kept\n\Z")
            done = self.hand_eye(service, good)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(pathlib.Path("pose_04/white.png"), self.files())

    def test_without_a_pose_it_uses_the_calibration_of_the_service(self):
        with self.service_seeing(*range(5)) as service:
            words = ["--socket", service.socket, "hand-eye", "--mounted", "arm", "--poses", "kuka", "--from", self.captures, "--service"]
            self.assertEqual(self.hand_eye(service, kuka(self.poses[0])).returncode, 0)
            early = slsctl("--json", *words, "--looks")
            self.assertEqual(early.returncode, 0, early.stderr)  # too few poses are no error
            self.assertIn("too few", json.loads(early.stdout.splitlines()[-1])["missing"])
            for pose in self.poses[1:5]:
                last = self.hand_eye(service, kuka(pose), options=["--json"])
            *views, told = map(json.loads, slsctl("--json", *words, "--looks").stdout.splitlines())
            self.assertEqual(told, json.loads(last.stdout))
            self.assertEqual([view["look"] for view in views], [f"pose_{i:02}" for i in range(5)])
            for i, view in enumerate(views):
                self.check_points(view, numpy.linalg.inv(self.poses[i] @ FLANGE_FROM_RIG) @ BASE_FROM_BOARD)
            self.assertEqual(slsctl("--json", *words).stdout, last.stdout)
            (self.captures / "pose_02/white.png").write_bytes((self.captures / "pose_02/white.png").read_bytes()[:100])
            self.assertEqual(slsctl(*words).returncode, 1)

    def check_points(self, view, rig_from_board):
        """As many as it says, and no further apart than the board is wide."""
        points = numpy.array(view["cameras"][0]["points_px"])
        self.assertEqual((len(view["cameras"]), len(points)), (1, view["corners"]))
        self.assertTrue((points.min() > -0.5) and (points.max(axis=0) < (799.5, 599.5)).all())
        self.assertLess(view["error_px"], 0.2)
        middle = (rig_from_board @ (210, 150, 0, 1))[:3]
        self.assertLess(abs(view["distance_mm"] - numpy.linalg.norm(middle)), 60)

    def test_poses_of_another_arm_are_named(self):
        random = numpy.random.default_rng(4)
        others = [motion(turn(random.normal(size=3), random.uniform(0.3, 2)), random.uniform(-800, 800, 3)) for _ in range(5)]
        with self.service_seeing(*range(5)) as service:
            done = [self.hand_eye(service, kuka(pose)) for pose in others]
        failed = [each for each in done if each.returncode]
        self.assertTrue(failed)
        for each in failed:
            self.assertEqual(each.returncode, 1)
            self.assertRegex(each.stderr, r"do not belong to these pictures.*another arm[\s\S]*is not kept\n\Z")
        self.assertFalse((self.captures / "hand_eye.yml").exists())

    def test_needs_a_service(self):
        self.captures = self.folder / "nowhere"
        service = Service(configuration=CONFIGURATION.format(folder=SCENE))
        done = self.hand_eye(service, kuka(self.poses[0]))
        self.assertEqual((done.returncode, done.stdout), (3, ""))
        self.assertFalse(self.captures.exists())


TWO_CAMERAS = """
[projector]
width_px = 640
height_px = 400
[[camera]]
name = "camera"
path = "left"
loop = false
[[camera]]
name = "right"
path = "right"
loop = false
[calibration]
file = "{folder}/calibration.yml"
[scan]
projector_latency_ms = 0.0
exposure_skew_ms = 10000
[server]
socket = "slsd.sock"
"""
NOTHING = b"P5 800 600 255\n" + bytes(800 * 600)


class TwoCameras(unittest.TestCase):
    """A rig of two: each view has two pictures, and one of them may lack the board."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        atexit.register(shutil.rmtree, cls.folder, ignore_errors=True)
        subprocess.run([BIN / "make_views", cls.folder, "8", "2"], check=True, timeout=300)
        rig_from_board = numpy.loadtxt(cls.folder / "views.csv", delimiter=",").reshape(-1, 4, 4)
        cls.poses = [BASE_FROM_BOARD @ numpy.linalg.inv(each) @ numpy.linalg.inv(FLANGE_FROM_RIG) for each in rig_from_board]

    def setUp(self):
        self.service = Service(configuration=TWO_CAMERAS.format(folder=self.folder))
        self.captures = self.service.folder / "captures"

    def copy(self, view, camera, to):
        shutil.copy(self.folder / f"pose_{view:02}" / camera / "white.png", to)

    def kept_captures(self, *views):
        """Those views, as the robot's program saves them."""
        for view in views:
            for camera in ("camera", "right"):
                (self.captures / f"pose_{view:02}" / camera).mkdir(parents=True)
                self.copy(view, camera, self.captures / f"pose_{view:02}" / camera / "white.png")
        lines = [f"pose_{view:02}," + ",".join(f"{number:.6f}" for number in kuka(self.poses[view])) for view in views]
        (self.captures / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def from_files(self, *options):
        done = slsctl("--json", "hand-eye", "--mounted", "arm", "--poses", "kuka", "--from", self.captures, "--config", self.service.file,
                      "--looks", *options)
        return done, [json.loads(line) for line in done.stdout.splitlines()]

    def check_place(self):
        file = self.captures / "hand_eye.yml"
        place = matrix_of(file, "flange_from_rig_T") - FLANGE_FROM_RIG[:3, 3]
        rotation = matrix_of(file, "flange_from_rig_R").reshape(3, 3).T @ FLANGE_FROM_RIG[:3, :3]
        print(f"place off by {numpy.linalg.norm(place):.2f} mm, turn by {1000 * angle_of(rotation):.2f} mrad")
        self.assertLess(numpy.linalg.norm(place), 1.5)
        self.assertLess(angle_of(rotation), 1e-3)

    def test_both_pictures_of_each_view_count(self):
        self.kept_captures(*range(8))
        done, told = self.from_files()
        self.assertEqual(done.returncode, 0, done.stderr)
        for view in told[:-1]:
            self.assertEqual([each["name"] for each in view["cameras"]], ["camera", "right"])
            points = [len(each["points_px"]) for each in view["cameras"]]
            self.assertGreater(min(points), 15)
            self.assertEqual(sum(points), view["corners"])
            self.assertLess(view["error_px"], 0.2)
        self.assertEqual(told[-1]["poses"], 8)
        self.check_place()

    def test_either_camera_alone_may_see_the_board(self):
        self.kept_captures(*range(8))
        for view, camera in ((1, "camera"), (2, "right"), (5, "camera"), (6, "camera"), (6, "right")):
            (self.captures / f"pose_{view:02}" / camera / "white.png").unlink()
            (self.captures / f"pose_{view:02}" / camera / "white.pgm").write_bytes(NOTHING)
        done, told = self.from_files()
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = [[each["name"] for each in view.get("cameras", [])] for view in told[:-1]]
        self.assertEqual(seen[1:3] + seen[5:7], [["right"], ["camera"], ["right"], []])
        self.assertRegex(told[6]["unused"], ".+; .+")  # a reason of each camera
        self.assertEqual(told[-1]["poses"], 7)
        self.check_place()

    def test_a_camera_that_is_not_calibrated_is_named(self):
        self.kept_captures(*range(4))
        (self.captures / "pose_02/right").rename(self.captures / "pose_02/left")
        done, _ = self.from_files()
        self.assertEqual(done.returncode, 1)
        self.assertIn("left: the calibration has no camera of this name", done.stdout + done.stderr)

    def test_view_by_view_with_the_service(self):
        for camera, folder in (("camera", "left"), ("right", "right")):
            (self.service.folder / folder).mkdir()
            for view in range(8):
                self.copy(view, camera, self.service.folder / folder / f"{view:02}.png")
        (self.service.folder / "right/03.png").unlink()
        (self.service.folder / "right/03.pgm").write_bytes(NOTHING)
        with self.service as service:
            service.wait_ready()
            for pose in self.poses:
                numbers = ",".join(f"{number:.6f}" for number in kuka(pose))
                done = slsctl("--json", "--socket", service.socket, "hand-eye", "--mounted", "arm", "--poses", "kuka", "--from", self.captures,
                              f"--pose={numbers}")
                self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(json.loads(done.stdout)["poses"], 8)
        self.assertEqual(sorted(str(each.relative_to(self.captures)) for each in self.captures.glob("pose_03/*/*")),
                         ["pose_03/camera/white.png", "pose_03/right/white.png"])
        self.check_place()


if __name__ == "__main__":
    unittest.main(verbosity=2)
