#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds as ROS 2 itself sees it: rclpy and rmw_fastrtps of the Python package index, on loopback.

SLSD_ROS_PYTHON names an interpreter that has them; without it that of build/ros-venv, which ./run test fills. Any number
of triggers by SLSD_ROS_CALLS (30).
"""
import json
import os
import pathlib
import subprocess
import sys
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import patience  # noqa: E402, F401
import slsd  # noqa: E402
from dds_bridge import DOMAIN, FIELDS, RECORD, Bridge  # noqa: E402
from service import BIN, Service  # noqa: E402

LOCALHOST = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
PYTHON = os.environ.get("SLSD_ROS_PYTHON", str(HERE.parents[1] / "build/ros-venv/bin/python"))
CALLS = int(os.environ.get("SLSD_ROS_CALLS", "30"))
CLOUD_HASH = "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"


def has_ros():
    try:
        return subprocess.run([PYTHON, "-c", "import rclpy, sensor_msgs.msg, std_srvs.srv, diagnostic_msgs.msg"],
                              capture_output=True, timeout=600, check=False).returncode == 0
    except OSError:
        return False


def node(*arguments, **environment):
    """What a node of ROS says of scanner "left"."""
    mine = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "RMW_", "PYTHONPATH"))}
    done = subprocess.run([PYTHON, HERE / "ros_node.py", "left", "camera", *arguments], capture_output=True, text=True, timeout=600,
                          env={**mine, "ROS_DOMAIN_ID": str(DOMAIN), **(environment or LOCALHOST)}, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout)


def shown(service, *options, **environment):
    """It finds nodes as ROS's own do: by the environment alone."""
    return Bridge(service, *options, network=["--domain", str(DOMAIN)], **(environment or LOCALHOST))


@unittest.skipUnless(has_ros(), "no rclpy: the wheels of ROS 2 come from the network")
class Ros(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)

    def test_reads_clouds_and_the_graph_and_triggers(self):
        with shown(self.service, "--rate", "5", "--image-rate", "2"), slsd.Scanner(self.service.socket) as scanner:
            seen = node("--calls", str(CALLS), "--topics", "points", "camera_info", "image", "compressed")
            expected = scanner.scan().points
        self.assertTrue(seen["found"])
        self.assertEqual(len(seen["answers"]), CALLS)
        for answer in seen["answers"]:
            self.assertIsNotNone(answer, "a trigger had no answer")
            self.assertTrue(answer[0], answer)
            self.assertRegex(answer[1], rf"^{len(expected)} points, scan ")
        print(f"{seen['rmw']}: {len(seen['answers'])} of {CALLS} triggers in {seen['seconds']:.1f} s, {seen['counts']}")
        self.assertEqual(seen["nodes"].count(["slsd", "/left"]), 1)
        self.assertIn(["/left/trigger", ["std_srvs/srv/Trigger"]], seen["services"])
        for topic in ("/left/points", "/left/camera/camera_info", "/left/camera/image_raw", "/diagnostics"):
            (endpoint,) = [one for one in seen["endpoints"] if one[0] == topic]
            self.assertEqual(endpoint[1:3], ["/left", "slsd"])
            self.assertRegex(endpoint[3], "RIHS01_[0-9a-f]{64}")
        self.assertIn(CLOUD_HASH, next(one[3] for one in seen["endpoints"] if one[0] == "/left/points"))
        cloud = seen["points"]
        self.assertEqual([cloud["height"], cloud["width"], cloud["point_step"], cloud["row_step"], cloud["is_dense"]],
                         [1, len(expected), 24, 24 * len(expected), True])
        self.assertEqual([tuple(field) for field in cloud["fields"]], FIELDS)
        self.assertEqual(cloud["frame_id"], "left_optical_frame")
        self.assertLess(abs(cloud["stamp"] - time.time()), 600)
        points = np.frombuffer(bytes.fromhex(cloud["data"]), RECORD)
        for ours, theirs in (("x", "x"), ("y", "y"), ("z", "z"), ("sigma", "sigma_mm")):
            np.testing.assert_array_equal(points[ours], expected[theirs] / np.float32(1000))
        for name in ("intensity", "camera"):
            np.testing.assert_array_equal(points[name], expected[name])
        for key in ("points", "camera_info", "image", "compressed"):
            self.assertGreater(seen["counts"][key], 2, key)
        self.assertEqual(seen["compressed"][0], "mono8; jpeg compressed mono8")

    def test_reads_dense_clouds_and_depth_images_by_best_effort(self):
        with shown(self.service, "--rate", "1", "--density", "pixels"):
            seen = node("--topics", "points", "depth", "depth_info")
        for key in ("points", "depth", "depth_info"):
            self.assertGreater(seen["counts"][key], 2, key)
        width, height, encoding, size = seen["pictures"]["depth"]
        self.assertEqual([encoding, size], ["32FC1", 4 * width * height])
        self.assertEqual(seen["infos"]["depth_info"][:2], [width, height])

    def test_is_answered_beside_a_client_of_another_middleware(self):
        call = [BIN / "dds_probe", "--domain", str(DOMAIN), "--call", "left"]  # as rmw_cyclonedds does
        with shown(self.service, "--rate", "0"):
            others = [subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) for _ in range(3)]
            seen = node("--calls", str(CALLS))
            for other in others:
                out, _ = other.communicate(timeout=600)
                self.assertRegex(out, r"^1122334455667788 42 1 \d+ points, scan ")
        self.assertEqual([answer and answer[0] for answer in seen["answers"]], [True] * CALLS)

    def test_finds_it_however_both_are_restricted_to_this_host(self):
        only, peers = {"ROS_LOCALHOST_ONLY": "1"}, {**LOCALHOST, "ROS_STATIC_PEERS": "127.0.0.1"}
        for ours, theirs in ((only, only), (only, LOCALHOST), (LOCALHOST, only), (peers, LOCALHOST), (LOCALHOST, peers)):
            with self.subTest(ours=ours, theirs=theirs), shown(self.service, "--rate", "5", **ours):
                seen = node("--calls", "1", "--topics", "points", **theirs)
                self.assertEqual([answer and answer[0] for answer in seen["answers"]], [True])
                self.assertGreater(seen["counts"]["points"], 2)
                self.assertEqual(seen["nodes"].count(["slsd", "/left"]), 1)

    def test_finds_none_that_is_off(self):
        with shown(self.service, "--rate", "5", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF"):
            seen = node("--find", "20")
        self.assertEqual((seen["found"], seen["nodes"]), (False, [["reader", "/"]]))


if __name__ == "__main__":
    unittest.main()
