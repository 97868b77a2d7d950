#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds as the network sees it, on loopback: what it writes is read as bytes, by ROS's message definitions alone.

With SLSD_DDS_PYTHON, an interpreter that has Eclipse's package `cyclonedds` (pip install cyclonedds numpy), that reads the
same once more.
"""
import contextlib
import ipaddress
import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import robot_frame_test  # noqa: E402
import slsd  # noqa: E402
from dds_load import measure, take_domain  # noqa: E402
from python_test import Impostor, ply, result  # noqa: E402
from service import BIN, SCENE, Service, wait_until  # noqa: E402

DOMAIN, HELD = take_domain()
LOOPBACK = ["--domain", str(DOMAIN), "--interface", "lo", "--peer", "127.0.0.1"]


class Cdr:
    """Plain CDR, little-endian: what ROS 2 puts on the wire."""

    def __init__(self, data):
        assert data[:2] == b"\x00\x01", data[:4]
        self.data, self.at = data[4:], 0

    def number(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        self.at += size
        return struct.unpack_from("<" + kind, self.data, self.at - size)[0]

    def numbers(self, kind, count):
        return [self.number(kind) for _ in range(count)]

    def text(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at - 1].decode()

    def octets(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at]

    def sequence(self, item):
        return [item() for _ in range(self.number("I"))]

    def header(self):
        return {"stamp": self.number("i") + self.number("I") * 1e-9, "frame_id": self.text()}

    def point_cloud(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"),
                "fields": self.sequence(lambda: (self.text(), self.number("I"), self.number("B"), self.number("I"))),
                "is_bigendian": self.number("B"), "point_step": self.number("I"), "row_step": self.number("I"),
                "data": self.octets(), "is_dense": self.number("B")}

    def camera_info(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"),
                "distortion_model": self.text(), "d": self.sequence(lambda: self.number("d")),
                "k": self.numbers("d", 9), "r": self.numbers("d", 9), "p": self.numbers("d", 12),
                "binning": self.numbers("I", 2), "roi": self.numbers("I", 4) + [self.number("B")]}

    def image(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"), "encoding": self.text(),
                "is_bigendian": self.number("B"), "step": self.number("I"), "data": self.octets()}

    def transforms(self):
        return self.sequence(lambda: {"header": self.header(), "child": self.text(), "translation": self.numbers("d", 3),
                                      "rotation": self.numbers("d", 4)})

    def diagnostics(self):
        return {"header": self.header(), "status": self.sequence(lambda: {
            "level": self.number("B"), "name": self.text(), "message": self.text(), "hardware_id": self.text(),
            "values": dict(self.sequence(lambda: (self.text(), self.text())))})}


def probe(topic, kind, *more):
    done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--topic", topic, "--type", kind, *more],
                          capture_output=True, timeout=120, check=True)
    samples, data = [], done.stdout
    while data:
        size = struct.unpack_from("<I", data)[0]
        samples.append(Cdr(data[4:4 + size]))
        data = data[4 + size:]
    return samples


def transforms():
    """The newest of /tf_static, by their children."""
    (sample,) = probe("tf_static", "TFMessage", "--latched")
    return {transform["child"]: transform for transform in sample.transforms()}


def turn(quaternion):
    """The rotation that a unit quaternion (x, y, z, w) stands for."""
    x, y, z, w = quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


class Listener:
    """What is published on a topic, as it comes: the newest sample, and a reader of its own process."""

    def __init__(self, topic, kind, *more):
        self.process = subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--topic", topic, "--type", kind, "--count",
                                         "1000000000", "--seconds", "3600", *more], stdout=subprocess.PIPE)
        self.samples, self.count = {}, 0
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        while size := self.process.stdout.read(4):
            self.take(Cdr(self.process.stdout.read(struct.unpack("<I", size)[0])))
            self.count += 1

    def take(self, sample):
        self.samples = {"": sample}

    def next(self):
        """One that came after this was asked for."""
        seen = self.count
        wait_until(lambda: self.count > seen, "a sample")
        return self.samples[""]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(600)
        self.thread.join()
        self.process.stdout.close()


class States(Listener):
    """/diagnostics, the newest of each name."""

    def __init__(self):
        super().__init__("diagnostics", "DiagnosticArray")

    def take(self, sample):
        for status in sample.diagnostics()["status"]:
            self.samples[status["name"]] = status


class Bridge:
    def __init__(self, service, *more, name="left", network=LOOPBACK, **environment):
        self.log = tempfile.TemporaryFile("w+")
        socket = ["--socket", service.socket] if service else []
        self.process = subprocess.Popen([BIN / "slsd-dds", *socket, "--name", name, *network, *more], stderr=self.log,
                                        env={**os.environ, **environment})

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(600)
        finally:
            self.process.kill()
            self.process.wait()
            self.log.close()


FIELDS = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("sigma", 12, 7, 1), ("intensity", 16, 7, 1), ("camera", 20, 2, 1)]
RECORD = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma", "<f4"), ("intensity", "<f4"), ("camera", "u1"),
                   ("padding", "u1", 3)])


def matrix(calibration, key):
    return [float(number) for number in re.search(key + r":.*?data:\s*\[(.*?)\]", calibration, re.S)[1].split(",")]


class Shown(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.bridge = Bridge(cls.service, "--rate", "5", "--image-rate", "2")
        cls.addClassCleanup(cls.bridge.__exit__)
        cls.scanner = slsd.Scanner(cls.service.socket)
        cls.addClassCleanup(cls.scanner.close)

    def same_cloud(self, message):
        expected = self.scanner.scan().points
        self.assertEqual([message["height"], message["width"], message["point_step"], message["row_step"]],
                         [1, len(expected), 24, 24 * len(expected)])
        self.assertEqual([message["is_bigendian"], message["is_dense"]], [0, 1])
        self.assertEqual([tuple(field) for field in message["fields"]], FIELDS)
        self.assertEqual(message["header"]["frame_id"], "left_optical_frame")
        self.assertLess(abs(message["header"]["stamp"] - time.time()), 600)
        points = np.frombuffer(message["data"], RECORD)
        for ours, theirs in (("x", "x"), ("y", "y"), ("z", "z"), ("sigma", "sigma_mm")):
            np.testing.assert_array_equal(points[ours], expected[theirs] / np.float32(1000))
        for name in ("intensity", "camera"):
            np.testing.assert_array_equal(points[name], expected[name])

    def test_clouds_are_those_of_the_socket_in_metres(self):
        self.same_cloud(probe("left/points", "PointCloud2")[0].point_cloud())
        self.same_cloud(probe("left/points", "PointCloud2", "--best-effort")[0].point_cloud())

    def test_camera_info_is_the_calibration(self):
        calibration = self.scanner.settings()["calibration"]
        info = probe("left/camera/camera_info", "CameraInfo")[0].camera_info()
        k = matrix(calibration, "camera_matrix")
        self.assertEqual(info["k"], k)
        self.assertEqual(info["d"], matrix(calibration, "camera_distortion"))
        self.assertEqual(info["r"], [1, 0, 0, 0, 1, 0, 0, 0, 1])
        self.assertEqual(info["p"], [*k[0:3], 0, *k[3:6], 0, *k[6:9], 0])
        frame = self.scanner.frame()
        self.assertEqual((info["height"], info["width"]), frame.image.shape)
        self.assertEqual([info["distortion_model"], info["binning"], info["roi"]], ["plumb_bob", [0, 0], [0] * 5])
        self.assertEqual(info["header"]["frame_id"], "left_optical_frame")

    def test_images_are_the_frames(self):
        message = probe("left/camera/image_raw", "Image")[0].image()
        frame = self.scanner.frame().image
        self.assertEqual([message["height"], message["width"], message["step"], message["encoding"]],
                         [*frame.shape, frame.shape[1], "mono8"])
        np.testing.assert_array_equal(np.frombuffer(message["data"], np.uint8).reshape(frame.shape), frame)

    def test_the_optical_frame_hangs_on_the_scanners_body(self):
        transform = transforms()["left_optical_frame"]
        self.assertEqual(transform["header"]["frame_id"], "left_link")
        self.assertEqual(transform["translation"], [0, 0, 0])
        x, y, z, w = np.array(transform["rotation"])
        forward = np.array([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])  # of the optical z
        np.testing.assert_allclose(forward, [1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(np.abs([x, y, z, w]), 0.5, atol=1e-12)

    def test_the_projector_stands_where_the_calibration_has_it(self):
        calibration = self.scanner.settings()["calibration"]
        r, t = np.reshape(matrix(calibration, r"\bR"), (3, 3)), np.array(matrix(calibration, r"\bT"))
        transform = transforms()["left_projector_optical_frame"]
        self.assertEqual(transform["header"]["frame_id"], "left_optical_frame")
        np.testing.assert_allclose(transform["translation"], -r.T @ t / 1000, atol=1e-12)
        np.testing.assert_allclose(turn(transform["rotation"]), r.T, atol=1e-12)

    def test_the_robot_description_is_that_which_it_prints(self):
        (sample,) = probe("left/robot_description", "String", "--latched")
        printed = subprocess.run([BIN / "slsd-dds", "--name", "left", "--socket", self.service.socket, "--describe"],
                                 capture_output=True, text=True, timeout=600, check=True).stdout
        self.assertIn("left_projector_optical_frame", printed)
        self.assertEqual(sample.text(), printed)

    def test_diagnostics_tell_its_state(self):
        (status,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
        self.assertEqual((status["level"], status["name"], status["message"]), (0, "left: slsd", "ready to scan"))
        self.assertEqual(status["values"]["camera"], "ready")
        self.assertEqual(status["values"]["clouds lost before publishing"], "0")

    def test_the_trigger_service_scans(self):
        done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True, text=True,
                              timeout=120, check=True)
        self.assertRegex(done.stdout, rf"^1122334455667788 42 1 {len(self.scanner.scan())} points, scan ")

    def test_another_of_the_same_name_is_told(self):
        probe("left/points", "PointCloud2")  # it is there
        with Bridge(self.service) as second:
            self.assertEqual(second.process.wait(600), 1)
            self.assertIn("name_taken", second.said())

    def test_buffers_too_small_for_a_dense_cloud_are_told(self):
        allowed = int(pathlib.Path("/proc/sys/net/core/rmem_max").read_text(encoding="utf-8"))
        probe("left/points", "PointCloud2")  # it has begun
        self.assertEqual(f"net.core.rmem_max is {allowed}: " in self.bridge.said(), allowed < 10 << 20)

    def test_an_independent_reader_reads_the_same(self):
        python = os.environ.get("SLSD_DDS_PYTHON")
        if not python:
            self.skipTest("SLSD_DDS_PYTHON names no interpreter with cyclonedds")
        done = subprocess.run([python, HERE / "dds_reader.py", str(DOMAIN)], capture_output=True, text=True, timeout=120,
                              check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        read = json.loads(done.stdout)
        cloud = read["points"]
        cloud["header"]["stamp"] = cloud["header"]["stamp"]["sec"] + cloud["header"]["stamp"]["nanosec"] * 1e-9
        cloud["data"] = bytes.fromhex(cloud["data"])
        cloud["fields"] = [tuple(field[key] for key in ("name", "offset", "datatype", "count"))
                           for field in cloud["fields"]]
        self.same_cloud(cloud)
        info = probe("left/camera/camera_info", "CameraInfo")[0].camera_info()
        for key in ("height", "width", "distortion_model", "d", "k", "r", "p"):
            self.assertEqual(read["info"][key], info[key], key)
        self.assertEqual([read["info"]["binning_x"], read["info"]["binning_y"]], info["binning"])
        self.assertEqual([int(value) for value in read["info"]["roi"].values()], info["roi"])
        self.assertEqual(read["info"]["header"]["frame_id"], info["header"]["frame_id"])
        image = probe("left/camera/image_raw", "Image")[0].image()
        read["image"]["data"] = bytes.fromhex(read["image"]["data"])
        for key in ("height", "width", "encoding", "is_bigendian", "step", "data"):
            self.assertEqual(read["image"][key], image[key], key)
        (status,) = read["diagnostics"]["status"]
        (expected,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
        for key in ("level", "name", "message", "hardware_id"):
            self.assertEqual(status[key], expected[key], key)
        self.assertEqual([pair["key"] for pair in status["values"]], list(expected["values"]))
        self.assertEqual({pair["key"]: pair["value"] for pair in status["values"]}["camera"], "ready")
        self.assertEqual((read["trigger"]["client_guid"], read["trigger"]["sequence_number"], read["trigger"]["success"]),
                         (0x1122334455667788, 7, True))
        self.assertRegex(read["trigger"]["message"], rf"^{len(self.scanner.scan())} points, scan ")
        self.assertEqual(len(read["transforms"]["transforms"]), len(transforms()))
        for transform in read["transforms"]["transforms"]:
            expected = transforms()[transform["child_frame_id"]]
            self.assertEqual(transform["header"]["frame_id"], expected["header"]["frame_id"])
            self.assertEqual(list(transform["transform"]["rotation"].values()), expected["rotation"])
            self.assertEqual(list(transform["transform"]["translation"].values()), expected["translation"])


class Thinned(unittest.TestCase):
    def shown(self, density, *more):
        """What is published of a scan, and the whole of it in metres."""
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            whole = scanner.scan(density=density, timeout_s=60).points
            with Bridge(service, "--rate", "2", "--density", density, *more):
                message = probe("left/points", "PointCloud2")[0].point_cloud()
        return np.frombuffer(message["data"], RECORD), whole

    def test_by_voxels_has_the_first_point_of_each(self):
        points, whole = self.shown("symbols", "--voxel", "50")
        cells = np.floor(np.stack([whole[axis] for axis in "xyz"], axis=1).astype(float) / 50)
        _, first = np.unique(cells, axis=0, return_index=True)
        self.assertLess(len(first), len(whole) / 2)
        for axis in "xyz":
            np.testing.assert_array_equal(points[axis], whole[axis][np.sort(first)] / np.float32(1000))

    def test_by_stride_has_every_third_pixel_of_every_third_row(self):
        points, whole = self.shown("pixels", "--stride", "3")
        self.assertAlmostEqual(len(points) / len(whole), 1 / 9, delta=0.01)
        every = {tuple(point) for point in np.stack([whole[axis] / np.float32(1000) for axis in "xyz"], axis=1).tolist()}
        self.assertTrue(every.issuperset(map(tuple, np.stack([points[axis] for axis in "xyz"], axis=1).tolist())))

    def test_to_what_may_leave_says_so_and_counts_the_rest(self):
        with Service() as service, Bridge(service, "--density", "pixels", "--rate-max", "1") as bridge, \
                States() as states, Listener("left/points", "PointCloud2") as clouds:
            clouds.next()
            clouds.next()
            wait_until(lambda: int(states.samples.get("left: slsd", {"values": {"clouds lost before publishing": "0"}})["values"]
                                   ["clouds lost before publishing"]) > 2, "that clouds are lost")
            self.assertEqual(bridge.said().count("clouds exceed the rate limit"), 1)


class InTheRobotsBase(unittest.TestCase):
    def shown(self, mounted, *more, **scan):
        """A published cloud, and the scan of the socket, in the frame as configured."""
        service = Service(configuration=robot_frame_test.CONFIGURATION.format(
            scene=SCENE, frame='output = "robot_base"\nhand_eye = "hand_eye.yml"'))
        (service.folder / "hand_eye.yml").write_text(robot_frame_test.hand_eye(mounted), encoding="utf-8")
        with service, slsd.Scanner(service.socket) as scanner:
            whole = scanner.scan(density="pixels", timeout_s=60, **scan)
            with Bridge(service, "--rate", "2", "--density", "pixels", *more):
                message = probe("left/points", "PointCloud2")[0].point_cloud()
        return message["header"]["frame_id"], np.frombuffer(message["data"], RECORD), whole

    def check(self, points, whole):
        """Every second pixel of every second row is there, nothing else."""
        self.assertAlmostEqual(len(points) / len(whole.points), 1 / 4, delta=0.01)
        every = {tuple(point) for point in np.stack([whole.points[axis] / np.float32(1000) for axis in "xyz"], axis=1).tolist()}
        self.assertTrue(every.issuperset(map(tuple, np.stack([points[axis] for axis in "xyz"], axis=1).tolist())))

    def test_with_the_scanner_in_the_cell(self):
        frame, points, whole = self.shown("cell", "--robot-base", "ur10_base")
        self.assertEqual(frame, "ur10_base")
        np.testing.assert_allclose(np.reshape(whole.description["base_from_rig"], (4, 4)), robot_frame_test.MOUNT, atol=1e-6)
        self.check(points, whole)

    def test_with_the_scanner_on_the_arm_clouds_stay_with_the_scanner(self):
        frame, points, whole = self.shown("arm", coordinate_frame="rig")
        self.assertEqual(frame, "left_optical_frame")
        self.check(points, whole)


class Empty(unittest.TestCase):
    def test_clouds_say_why(self):
        with Service(camera_path=SCENE / "black.png") as dark, Bridge(dark, "--rate", "5"), States() as states:
            done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"], capture_output=True, text=True,
                                  timeout=120, check=True)
            self.assertRegex(done.stdout, r" 1 0 points, scan \S+: no symbol of the pattern was decoded")
            wait_until(lambda: states.samples.get("left: slsd", {}).get("message", "").startswith(
                "the last cloud is empty: no symbol of the pattern was decoded"), "why it is empty")
            self.assertEqual(states.samples["left: slsd"]["level"], 1)


class Usage(unittest.TestCase):
    def test_that_is_misspelt_is_answered_with_the_nearest(self):
        for words, hint in ((["--intefrace", "lo"], "did you mean --interface?"), (["--density", "pixel"], "did you mean pixels?"),
                            (["--stride", "0"], '"0" is not a number from 1 to 16'),
                            (["--name", "--rate"], "a value is missing before --rate"),
                            (["--scanner", "left"], "--scanner needs --merge"), (["left"], 'unexpected argument "left"')):
            done = subprocess.run([BIN / "slsd-dds", *words], capture_output=True, text=True, timeout=600, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn(hint, done.stderr)


class Twins(unittest.TestCase):
    def test_that_start_at_once_are_told_too(self):
        with Service() as service, Bridge(service, name="twin") as one, Bridge(service, name="twin") as other:
            wait_until(lambda: "name_taken" in one.said() + other.said(), "that the name is taken")


class Stalling(unittest.TestCase):
    def test_of_a_reader_costs_the_others_nothing(self):
        got = measure(points=40_000, clouds=30, stalled=True)
        self.assertEqual((got["sent"], got["lost"]), (30, 0))

    def test_of_nobody_loses_nothing_among_many(self):
        got = measure(scanners=4, clouds=20)
        self.assertEqual((got["sent"], got["lost"]), (80, 0))


class Discovery(unittest.TestCase):
    """What ROS's environment says of who is looked for."""

    def listens(self, bridge):
        """The addresses and ports of the sockets that it has."""
        inodes = set()
        for link in pathlib.Path(f"/proc/{bridge.process.pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                target = os.readlink(link)
                if target.startswith("socket:["):
                    inodes.add(target[8:-1])
        lines = [line.split() for line in pathlib.Path("/proc/net/udp").read_text(encoding="utf-8").splitlines()[1:]]
        local = [line[1].split(":") for line in lines if line[9] in inodes]
        return {(str(ipaddress.IPv4Address(int(address, 16).to_bytes(4, "little"))), int(port, 16)) for address, port in local}

    def started(self, service, **environment):
        bridge = Bridge(service, "--rate", "5", name="found", network=["--domain", str(DOMAIN)], **environment)
        self.addCleanup(bridge.__exit__)
        wait_until(lambda: len(self.listens(bridge)) >= 3, "that it listens")
        return bridge

    MULTICAST = 7400 + 250 * DOMAIN

    def test_of_this_host_alone_listens_on_loopback_alone(self):
        with Service() as service:
            for environment in ({"ROS_LOCALHOST_ONLY": "1"}, {"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "192.0.2.1"},
                                {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
                                {"ROS_AUTOMATIC_DISCOVERY_RANGE": "anything"}):
                bridge = self.started(service, **environment)
                self.assertEqual({address for address, _ in self.listens(bridge)}, {"127.0.0.1"}, environment)
                self.assertNotIn(self.MULTICAST, {port for _, port in self.listens(bridge)})
                self.assertEqual(len(probe("found/points", "PointCloud2")), 1)
                bridge.__exit__()

    def test_that_is_off_is_seen_by_nobody(self):
        with Service() as service:
            bridge = self.started(service, ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
            self.assertEqual({address for address, _ in self.listens(bridge)}, {"127.0.0.1"})
            self.assertEqual(probe("found/points", "PointCloud2", "--seconds", "6"), [])

    def test_of_the_subnet_listens_to_multicast_and_static_peers_do_not_need_it(self):
        with Service() as service:
            ports = lambda bridge: {port for _, port in self.listens(bridge)}  # noqa: E731
            self.assertIn(self.MULTICAST, ports(self.started(service)))
            bridge = self.started(service, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_STATIC_PEERS="127.0.0.1;192.0.2.1")
            self.assertNotIn(self.MULTICAST, ports(bridge))
            self.assertIn("0.0.0.0", {address for address, _ in self.listens(bridge)})

    def test_of_peers_that_are_no_hosts_is_refused(self):
        done = subprocess.run([BIN / "slsd-dds"], env={**os.environ, "ROS_STATIC_PEERS": "no.such.host.invalid"},
                              capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("no.such.host.invalid", done.stderr)


class Strangers(unittest.TestCase):
    def test_of_the_domain_cost_nothing(self):
        others = [subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--seconds", "600", "--write" if i % 2 else "--topic",
                                    f"stranger{i}/points"], stdout=subprocess.DEVNULL) for i in range(24)]
        # One has other things to say about scanners, under a name of its own.
        others.append(subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--seconds", "600", "--write", "map/points",
                                        "--bytes", "7", "--width", "4294967295"]))
        try:
            with Service() as service, Bridge(service, "--rate", "10", name="known") as bridge, States() as states, \
                    Listener("known/points", "PointCloud2") as clouds:
                wait_until(lambda: states.samples.get("known: slsd", {}).get("level") == 0, "the scanner")
                with slsd.Scanner(service.socket) as scanner:
                    self.assertEqual(clouds.next().point_cloud()["width"], len(scanner.scan()))
                # It may say of this host that its sockets are small.
                self.assertEqual([line for line in bridge.said().splitlines() if "net.core.rmem_max" not in line], [])
        finally:
            for other in others:
                other.terminate()
            for other in others:
                other.wait(600)

    def test_that_are_not_there_are_not_waited_for(self):
        with Service() as service, Bridge(service, "--peer", "192.0.2.1", "--peer", "192.0.2.2", "--rate", "5", name="known"), \
                Listener("known/points", "PointCloud2") as clouds:
            self.assertGreater(clouds.next().point_cloud()["width"], 0)

    def test_that_are_no_addresses_are_refused(self):
        for word in ("--interface", "--peer"):
            done = subprocess.run([BIN / "slsd-dds", word, "<no>"], capture_output=True, text=True, timeout=600, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("a name or an address", done.stderr)


class Impostors(unittest.TestCase):
    """What listens where slsd would is another program, or another version."""

    def told(self, answer, text):
        with Impostor(answer) as other, States() as states, Listener("left/points", "PointCloud2") as clouds:
            with Bridge(types.SimpleNamespace(socket=other.path)) as bridge:
                wait_until(lambda: text in bridge.said(), text)
                wait_until(lambda: states.samples.get("left: slsd", {}).get("level") == 2, "that something is wrong")
                self.assertIsNone(bridge.process.poll())
                self.assertEqual(clouds.count, 0)

    def test_are_told_and_nothing_of_theirs_is_published(self):
        def lies(request):
            answer = result(request, **({"ready": True} if request["method"] == "status" else {}))
            if request["method"] == "subscribe":
                cloud = ply(3, said=4)
                return answer + json.dumps({"jsonrpc": "2.0", "method": "cloud", "params": {"bytes": len(cloud)}}).encode() + b"\n" + cloud
            return answer

        self.told(lies, "but its header says")
        self.told(lambda request: b'{"jsonrpc": "3.0", "id": 1, "result": {}}\n', "not JSON-RPC 2.0")
        self.told(lambda request: b"220 mail ready\n", "not a valid answer of slsd")
        self.told(lambda request: result(request, cameras="none", calibration=7, ready=[]), "the service sent")


class Vanishing(unittest.TestCase):
    def test_of_a_service_that_stalls_is_told_and_overcome(self):
        with Service() as service, Bridge(service, "--rate", "5", name="top"), States() as states, \
                Listener("top/points", "PointCloud2") as clouds:
            wait_until(lambda: states.samples.get("top: slsd", {}).get("level") == 0, "the scanner")
            clouds.next()
            service.send_signal(signal.SIGSTOP)
            try:
                wait_until(lambda: "does not answer" in states.samples["top: slsd"]["message"], "that it stalls")
            finally:
                service.send_signal(signal.SIGCONT)
            wait_until(lambda: states.samples["top: slsd"]["level"] == 0, "the scanner again")
            clouds.next()

    def test_of_the_service_is_told_and_it_is_found_again(self):
        def state():
            samples = probe("diagnostics", "DiagnosticArray")
            (status,) = samples[0].diagnostics()["status"]
            return status["level"], status["message"]

        with Service() as service, Bridge(service, "--rate", "5", name="top"):
            wait_until(lambda: state()[0] == 0, "the scanner")
            service.stop(signal.SIGKILL)
            wait_until(lambda: state()[0] == 2, "an error")
            self.assertIn("no service answers", state()[1])
            service.socket.unlink(missing_ok=True)
            service.start()
            wait_until(lambda: state()[0] == 0, "the scanner again")
            self.assertEqual(len(probe("top/points", "PointCloud2")), 1)


class ExtrinsicsFile(unittest.TestCase):
    def write(self, text):
        file = tempfile.NamedTemporaryFile("w", suffix=".toml", delete=False)
        self.addCleanup(os.unlink, file.name)
        with file:
            file.write(text)
        return file.name

    GOOD = 'parent = "cell"\n[scanner.left]\nrotation = [0, -1, 0, 1, 0, 0, 0, 0, 1]\ntranslation_mm = [100, 0, 50]\n'

    def test_that_does_not_hold_is_refused_by_name(self):
        with Service() as service:
            for text, name in (("parent = \"cell\"\n", "extrinsics_missing"), ("nonsense", ":1"),
                               (self.GOOD.replace("[0, -1", "[0, -2"), "not a rotation"),
                               (self.GOOD.replace("100, 0, 50", "100, 0"), "3 numbers")):
                with Bridge(service, "--extrinsics", self.write(text)) as bridge:
                    self.assertEqual(bridge.process.wait(600), 1)
                    self.assertIn(name, bridge.said())

    def test_says_where_the_scanner_stands(self):
        with Service() as service, Bridge(service, "--extrinsics", self.write(self.GOOD), "--rate", "0"):
            transform = transforms()["left_optical_frame"]
            self.assertEqual(transform["header"]["frame_id"], "cell")
            np.testing.assert_allclose(transform["translation"], [0.1, 0, 0.05])
            np.testing.assert_allclose(transform["rotation"], [0, 0, 0.5**0.5, 0.5**0.5], atol=1e-12)

    def test_of_another_calibration_places_nothing(self):
        stale = self.write(self.GOOD + 'calibration_date = "2001-01-01T00:00:00Z"\n')
        with Service() as service, Bridge(service, "--extrinsics", stale, "--rate", "0"):
            self.assertEqual(list(transforms()), ["left_projector_optical_frame"])  # by the camera, not in the cell
            (status,) = probe("diagnostics", "DiagnosticArray")[0].diagnostics()["status"]
            self.assertEqual(status["level"], 2)
            self.assertIn("extrinsics_stale", status["message"])


if __name__ == "__main__":
    unittest.main()
