#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Clouds in the robot's base, against a transform in numpy. The scene is a plane, and the same frame each time."""
import json
import pathlib
import tempfile
import unittest

import numpy

from client import RpcError
from service import SCENE, Service, slsctl, slsd, wait_until

CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "file"
path = "{scene}/frame.png"
[calibration]
file = "{scene}/calibration.yml"
[frame]
{frame}
[scan]
timeout_ms = 600000
[server]
socket = "slsd.sock"
"""
TYPES = {"float": "<f4", "uchar": "u1", "int": "<i4"}
# Rx(0.3) Ry(-0.5) Rz(1.1), and the same from a rotation vector: written out, so that no code of slsd makes them.
MOUNT = numpy.array([[0.39806, -0.78211, -0.47943, 120.0], [0.78713, 0.53770, -0.30231, -45.5], [0.47447, -0.25700, 0.82318, 88.25],
                     [0, 0, 0, 1]])
MOUNT[:3, :3] = numpy.linalg.svd(MOUNT[:3, :3])[0] @ numpy.linalg.svd(MOUNT[:3, :3])[2]  # to all digits
POSE_UR = [0.4125, -0.231, 0.612, 0.9, -0.7, 1.3]


def rodrigues(vector):
    angle = numpy.linalg.norm(vector)
    x, y, z = numpy.array(vector) / angle
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross


def pose_of(numbers):
    """The matrix of a pose as UR writes it, mm."""
    matrix = numpy.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rodrigues(numbers[3:]), 1000 * numpy.array(numbers[:3])
    return matrix


def pose_matrix():
    return pose_of(POSE_UR)


def matrix_text(name, matrix):
    rows, columns = matrix.shape
    return (f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n"
            f"   data: [ {', '.join(repr(float(each)) for each in matrix.ravel())} ]\n")


def hand_eye(mounted, calibration_date=""):
    frame = "flange" if mounted == "arm" else "base"
    return (f'%YAML:1.0\n---\nmounted: "{mounted}"\n' + matrix_text(f"{frame}_from_rig_R", MOUNT[:3, :3]) +
            matrix_text(f"{frame}_from_rig_T", MOUNT[:3, 3:]) +
            (f'calibration_date: "{calibration_date}"\n' if calibration_date else ""))


def read_ply(data):
    header, body = bytes(data).split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    fields = [(line.split()[2], TYPES[line.split()[1]]) for line in lines if line.startswith("property")]
    return numpy.frombuffer(body, fields), lines


def read_pcd(data):
    header, body = bytes(data).split(b"DATA binary\n", 1)
    lines = header.decode().split("\n")
    words = {line.split()[0]: line.split()[1:] for line in lines if line}
    kinds = {("F", "4"): "<f4", ("U", "1"): "u1", ("I", "4"): "<i4"}
    fields = [(name, kinds[kind, size]) for name, kind, size in zip(words["FIELDS"], words["TYPE"], words["SIZE"])]
    return numpy.frombuffer(body, fields), words


def places(points, names=("x", "y", "z")):
    return numpy.stack([points[name].astype(float) for name in names], 1)


class RobotFrame(unittest.TestCase):
    def service(self, mounted="cell", output="robot_base", text=None):
        service = Service(configuration=CONFIGURATION.format(scene=SCENE, frame=f'output = "{output}"\nhand_eye = "hand_eye.yml"'))
        (service.folder / "hand_eye.yml").write_text(hand_eye(mounted) if text is None else text, encoding="utf-8")
        return service

    def refused(self, client, reason, method="scan", **params):
        with self.assertRaises(RpcError) as refused:
            client.call(method, **params)
        self.assertRegex(str(refused.exception), reason)

    def same(self, in_base, in_rig, base_from_rig, names=("x", "y", "z"), turn_only=False):
        rig, base = places(in_rig, names), places(in_base, names)
        there = rig @ base_from_rig[:3, :3].T + (0 if turn_only else base_from_rig[:3, 3])
        seen = numpy.isfinite(rig[:, 2])
        self.assertGreater(numpy.count_nonzero(seen), 500)
        numpy.testing.assert_array_equal(seen, numpy.isfinite(base[:, 2]))
        self.assertLess(numpy.abs(base - there)[seen].max(), 1e-3)

    def check_files(self, client, base_from_rig, **pose):
        for density, options in (("symbols", {}), ("pixels", {}), ("pixels", {"normals": True})):
            for form, read in (("ply", read_ply), ("pcd", read_pcd)):
                with self.subTest(density=density, form=form, **options):
                    about, in_base = client.call("scan", format=form, density=density, timeout_ms=600000, **options, **pose)
                    told = numpy.array(about["base_from_rig"]).reshape(4, 4)
                    numpy.testing.assert_allclose(told, base_from_rig, atol=1e-6)
                    about, in_rig = client.call("scan", format=form, density=density, coordinate_frame="rig", timeout_ms=600000, **options)
                    self.assertNotIn("base_from_rig", about)
                    (base, header), (rig, plain) = read(in_base), read(in_rig)
                    self.same(base, rig, base_from_rig)
                    if options:
                        normal = ("nx", "ny", "nz") if form == "ply" else ("normal_x", "normal_y", "normal_z")
                        self.same(base, rig, base_from_rig, normal, turn_only=True)
                    for name in set(base.dtype.names) - set("xyz") - {"nx", "ny", "nz", "normal_x", "normal_y", "normal_z"}:
                        numpy.testing.assert_array_equal(base[name], rig[name])
                    self.check_header(form, header, plain, base_from_rig)

    def check_header(self, form, header, plain, base_from_rig):
        if form == "ply":
            self.assertIn("comment coordinate_frame robot_base: the robot's", header)
            self.assertIn("comment coordinate_frame rig: the first camera's, x right, y down, z forward", plain)
            return
        x, y, z, *quaternion = map(float, header["VIEWPOINT"])
        numpy.testing.assert_allclose((x, y, z), base_from_rig[:3, 3], atol=1e-6)
        angle = 2 * numpy.arccos(min(1, abs(quaternion[0])))
        self.assertAlmostEqual(angle, numpy.arccos((numpy.trace(base_from_rig[:3, :3]) - 1) / 2), 6)
        self.assertEqual(plain["VIEWPOINT"], ["0", "0", "0", "1", "0", "0", "0"])

    def test_scanner_in_the_cell(self):
        with self.service() as service, service.client() as client:
            self.check_files(client, MOUNT)
            self.refused(client, "stands in the cell", robot_pose=POSE_UR, poses="ur")
            about, _ = client.call("scan", format="tiff", density="pixels", timeout_ms=600000)
            self.assertNotIn("base_from_rig", about)
            self.assertEqual(client.call("settings")[0]["hand_eye"], {"mounted": "cell"})
            client.call("subscribe", rate_hz=10)
            wait_until(lambda: self.next_cloud(client), "a cloud")
            numpy.testing.assert_allclose(numpy.array(self.event["base_from_rig"]).reshape(4, 4), MOUNT, atol=1e-6)
            self.assertNotIn("flange_from_rig", self.event)

    def next_cloud(self, client):
        message, _ = client.receive()
        self.event = message.get("params", {})
        return message.get("method") == "cloud"

    def test_scanner_on_the_arm(self):
        pose = {"robot_pose": POSE_UR, "poses": "ur"}
        with self.service("arm") as service, service.client() as client:
            self.check_files(client, pose_matrix() @ MOUNT, **pose)
            self.refused(client, r'on the robot\'s arm: add the robot\'s pose as "robot_pose" and "poses"')
            self.refused(client, '"robot_pose" needs "poses"', robot_pose=POSE_UR)
            self.refused(client, '"poses" is no notation of poses: ur, ', robot_pose=POSE_UR, poses="scara")
            self.refused(client, '"robot_pose" has 5 numbers instead of 6', robot_pose=POSE_UR[:5], poses="ur")
            self.refused(client, '"robot_pose" must be a list of 1 to 16 numbers', robot_pose=[None] * 6, poses="ur")
            self.refused(client, "is for points or a box in the robot's base", coordinate_frame="rig", **pose)
            metres_as_mm = "puts the flange 0.7733 mm from the robot's base"
            self.refused(client, metres_as_mm, robot_pose=POSE_UR, poses="ur-pendant")
            in_mm = [1000 * each for each in POSE_UR[:3]] + POSE_UR[3:]
            self.refused(client, "puts the flange 7.733e\\+05 mm", robot_pose=in_mm, poses="ur")
            self.refused(client, "quaternion has length", robot_pose=[400, 0, 300, 0.5, 0.5, 0.5, 0.9], poses="abb")
            self.refused(client, 'no poses come with a stream: ask for "coordinate_frame": "rig", or scan at each place with "robot_pose"', "subscribe", coordinate_frame="robot_base")
            client.call("subscribe", rate_hz=10)  # in the rig's frame
            wait_until(lambda: self.next_cloud(client), "a cloud")
            self.assertNotIn("base_from_rig", self.event)
            for about in (self.event, client.call("scan", coordinate_frame="rig")[0], client.call("scan", **pose)[0]):
                numpy.testing.assert_allclose(numpy.array(about["flange_from_rig"]).reshape(4, 4), MOUNT, atol=1e-6)

    def test_box_and_plane_in_the_robots_base(self):
        for mounted, pose in (("cell", {}), ("arm", {"robot_pose": POSE_UR, "poses": "ur"})):
            with self.subTest(mounted), self.service(mounted) as service, service.client() as client:
                points = read_ply(client.call("scan", timeout_ms=600000, **pose)[1])[0]
                at = places(points)
                middle = numpy.median(at, axis=0)
                box = [*(middle - 150), *(middle + 90)]
                params = {"box": box, "box_frame": "robot_base", "timeout_ms": 600000, **pose}
                inside = ((at >= box[:3]) & (at <= box[3:])).all(axis=1)
                self.assertTrue(50 < numpy.count_nonzero(inside) < len(at) - 50)
                numpy.testing.assert_array_equal(places(read_ply(client.call("scan", **params)[1])[0]), at[inside])
                rig = read_ply(client.call("scan", coordinate_frame="rig", **params)[1])[0]
                self.assertEqual(len(rig), numpy.count_nonzero(inside))
                pixels = {"density": "pixels", **params}
                whole = read_ply(client.call("scan", density="pixels", timeout_ms=600000, **pose)[1])[0]
                of_box = ((places(whole) >= box[:3]) & (places(whole) <= box[3:])).all(axis=1)
                self.assertLess(abs(len(read_ply(client.call("scan", **pixels)[1])[0]) - numpy.count_nonzero(of_box)), 20)
                normal = numpy.array([0.48, -0.6, 0.64])
                above = at @ normal > normal @ middle
                plane = read_ply(client.call("scan", plane=[*normal, float(normal @ middle)], box_frame="robot_base", timeout_ms=600000, **pose)[1])[0]
                numpy.testing.assert_array_equal(places(plane), at[above])
                self.refused(client, "no camera sees the box .* in the robot's base", **{**params, "box": [*(middle + 9000), *(middle + 9100)]})
                if mounted == "arm":
                    self.refused(client, 'add the robot\'s pose .* "box_frame": "rig"', coordinate_frame="rig", box=box, box_frame="robot_base")
                client.call("set", cloud={"box": box, "box_frame": "robot_base"})
                self.assertEqual(client.call("preview", timeout_ms=600000)[0]["points"], len(at))
                if mounted == "arm":
                    self.refused(client, "no poses come with a stream: .* box and plane are in the robot's base; set them with \"box_frame\": \"rig\", or scan at each place with \"robot_pose\"", "subscribe", coordinate_frame="rig")
                    self.check_refused_while_it_runs(client, box)
                self.assertEqual(client.call("scan", timeout_ms=600000, **pose)[0]["points"], numpy.count_nonzero(inside))

    def check_refused_while_it_runs(self, client, box):
        """A box in the base that is set later: the stream says so instead of a cloud, and goes on without it."""
        client.call("set", cloud={"box": None, "box_frame": None})
        client.call("subscribe", rate_hz=10, coordinate_frame="rig")
        wait_until(lambda: self.next_cloud(client), "a cloud")
        client.call("set", cloud={"box": box, "box_frame": "robot_base"})
        told = []
        wait_until(lambda: told.append(client.receive()[0]) or "error" in json.dumps(told[-1]), "an error")
        self.assertIn("scan with the robot's pose, or set box_frame", json.dumps(told[-1]))
        client.call("unsubscribe")

    def test_box_in_the_robots_base_needs_its_place(self):
        with Service() as service, service.client() as client:
            self.refused(client, "the scanner's pose in the robot's base is unknown", box=[0, 0, 0, 1, 1, 1], box_frame="robot_base")

    def test_slsctl(self):
        pose = ",".join(map(str, POSE_UR))
        with self.service("arm") as service, tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            scan = lambda *words: slsctl("--socket", service.socket, "scan", *words)
            clouds = {}
            for kind, read in (("ply", read_ply), ("pcd", read_pcd)):
                for words in ((), ("--density", "pixels")):
                    name = pathlib.Path(folder) / f"cloud.{kind}"
                    picture = ("--cloud-picture", f"{folder}/{kind}{len(words)}.png")
                    done = scan(name, "--poses", "ur", f"--robot-pose={pose}", *words, *picture)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    base = read(name.read_bytes())[0]
                    self.assertEqual(scan(name, "--coordinate-frame", "rig", *words).returncode, 0)
                    self.same(base, read(name.read_bytes())[0], pose_matrix() @ MOUNT)
                    clouds[kind, words] = base
            obj = pathlib.Path(folder) / "part.obj"
            self.assertEqual(scan(obj, "--poses", "ur", f"--robot-pose={pose}").returncode, 0)
            corners = numpy.array([line.split()[1:4] for line in obj.read_text(encoding="utf-8").splitlines() if line.startswith("v ")], float)
            cloud = places(clouds["ply", ("--density", "pixels")])
            self.assertLess(numpy.abs(corners.min(0) - cloud.min(0)).max(), 20)
            self.assertLess(numpy.abs(corners.max(0) - cloud.max(0)).max(), 20)
            done = scan(f"{folder}/none.ply")
            self.assertEqual(done.returncode, 1)
            self.assertIn("the scanner is on the robot's arm", done.stderr)
            done = scan(f"{folder}/none.ply", "--poses", "ur", "--robot-pose=0.4,nan,0.6,0,0,1")
            self.assertEqual(done.returncode, 1)
            self.assertIn("1 to 16 numbers", done.stderr)
            self.assertEqual(scan("--robot-pose=0.4,0.2,0.6,0,0,1").returncode, 2)  # --poses is missing
            self.assertFalse((pathlib.Path(folder) / "none.ply").exists())
            done = slsctl("--socket", service.socket, "record", f"{folder}/kept", "--frames", 1, "--clouds")
            self.assertEqual(done.returncode, 0, done.stderr)
            kept = read_ply((pathlib.Path(folder) / "kept/clouds/00000000.ply").read_bytes())[1]
            self.assertIn("comment coordinate_frame rig: the first camera's, x right, y down, z forward", kept)

    def test_a_scan_may_ask_for_the_base(self):
        with self.service(output="rig") as service, service.client() as client:
            self.assertNotIn("base_from_rig", client.call("scan")[0])
            self.assertIn("base_from_rig", client.call("scan", coordinate_frame="robot_base")[0])
            self.refused(client, '"coordinate_frame" must be "rig" or "robot_base"', coordinate_frame="world")

    def test_a_service_without_a_hand_eye_calibration_refuses_the_base(self):
        with Service() as service, service.client() as client:
            self.refused(client, "run slsctl hand-eye, and set", coordinate_frame="robot_base")

    def test_a_wrong_or_missing_file_is_named(self):
        for text, reason in ((hand_eye("cell").replace("base_from_rig_R", "base_from_rig_Q"), "base_from_rig_R"),
                             (hand_eye("desk"), "mounted"), ("rubbish", "hand_eye.yml")):
            service = self.service(text=text)
            done = slsd("--config", service.file)
            self.assertEqual(done.returncode, 78, done.stderr)
            self.assertIn(reason, done.stderr)
        service = self.service()
        (service.folder / "hand_eye.yml").unlink()
        self.assertIn("hand_eye.yml", slsd("--config", service.file).stderr)
        service = Service(configuration=CONFIGURATION.format(scene=SCENE, frame='output = "robot_base"'))
        self.assertIn("needs hand_eye", slsd("--check-config", "--config", service.file).stderr)

    def test_a_reload_puts_another_file_into_force(self):
        with self.service() as service, service.client() as client:
            (service.folder / "hand_eye.yml").write_text("rubbish", encoding="utf-8")
            self.refused(client, "hand_eye.yml", "reload")
            numpy.testing.assert_allclose(client.call("scan")[0]["base_from_rig"][3], MOUNT[0, 3])
            (service.folder / "hand_eye.yml").write_text(hand_eye("arm"), encoding="utf-8")
            client.call("reload")
            self.refused(client, "on the robot's arm")
            self.assertEqual(client.call("scan", robot_pose=POSE_UR, poses="ur")[0]["tries"], 1)

    def test_a_calibration_after_the_hand_eye_calibration_is_named(self):
        with self.service() as service, service.client() as client:
            text = (SCENE / "calibration.yml").read_text(encoding="utf-8")
            (service.folder / "calibration.yml").write_text(text + 'date: "2026-02-02T00:00:00Z"\n', encoding="utf-8")
            (service.folder / "hand_eye.yml").write_text(hand_eye("cell", "2026-01-01T00:00:00Z"), encoding="utf-8")
            service.file.write_text(service.file.read_text(encoding="utf-8").replace(f"{SCENE}/calibration.yml", "calibration.yml"), encoding="utf-8")
            client.call("reload")
            self.refused(client, "measured with the calibration of 2026-01-01.*one in force is of 2026-02-02.*run slsctl hand-eye again")
            self.assertGreater(client.call("scan", coordinate_frame="rig")[0]["points"], 500)


if __name__ == "__main__":
    unittest.main(verbosity=2)
