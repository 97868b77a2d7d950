# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A node of ROS 2 by its own client library, with the middleware and sockets that are its defaults.

usage: ros_node.py NAME CAMERA [--calls N] [--topics TOPIC...] [--find S] [--seconds S] [--measure S] [--reliable]

Reads topics of scanner NAME, calls its trigger, and prints what it saw as JSON.
"""
import argparse
import json
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_srvs.srv import Trigger


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("name")
    parser.add_argument("camera")
    parser.add_argument("--calls", type=int, default=0, help="of the trigger")
    parser.add_argument("--topics", nargs="*", default=[], help="to read, beside diagnostics")
    parser.add_argument("--find", type=float, default=300, help="seconds to wait for the scanner")
    parser.add_argument("--seconds", type=float, default=300, help="to wait for three samples of each topic")
    parser.add_argument("--measure", type=float, default=0, help="seconds of reading, instead")
    parser.add_argument("--reliable", action="store_true", help="do not ask for sensors' QoS")
    return parser.parse_args()


def topics_of(name, camera):
    return {"points": (PointCloud2, f"/{name}/points"), "camera_info": (CameraInfo, f"/{name}/{camera}/camera_info"),
            "image": (Image, f"/{name}/{camera}/image_raw"),
            "compressed": (CompressedImage, f"/{name}/{camera}/image_raw/compressed"),
            "depth": (Image, f"/{name}/{camera}/depth/image_raw"),
            "depth_info": (CameraInfo, f"/{name}/{camera}/depth/camera_info"),
            "diagnostics": (DiagnosticArray, "/diagnostics")}


class Reader:
    """The newest message of each topic, and the writer's number of each that came."""

    def __init__(self, node, topics, wanted, quality):
        self.newest, self.numbers = {}, {key: [] for key in topics}
        for key in wanted:
            kind, topic = topics[key]
            node.create_subscription(kind, topic, self.taker(key), quality)

    def taker(self, key):
        def take(message, info):
            self.newest[key] = message
            self.numbers[key].append(info["publication_sequence_number"])
        return take

    def counts(self):
        return {key: len(numbers) for key, numbers in self.numbers.items()}


def call(node, client, calls):
    answers = []
    for _ in range(calls):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=120)
        answers.append([future.result().success, future.result().message] if future.done() else None)
    return answers


def wait_for_node(node, wanted, end):
    while wanted not in node.get_node_names_and_namespaces() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)


def described(newest):
    points, compressed = newest.get("points"), newest.get("compressed")
    return {
        "points": points and {
            "frame_id": points.header.frame_id, "stamp": points.header.stamp.sec + 1e-9 * points.header.stamp.nanosec,
            "height": points.height, "width": points.width, "point_step": points.point_step, "row_step": points.row_step,
            "fields": [[f.name, f.offset, f.datatype, f.count] for f in points.fields], "is_dense": points.is_dense,
            "data": bytes(points.data).hex()},
        "pictures": {key: [newest[key].width, newest[key].height, newest[key].encoding, len(newest[key].data)]
                     for key in ("image", "depth") if key in newest},
        "infos": {key: [newest[key].width, newest[key].height, list(newest[key].k)]
                  for key in ("camera_info", "depth_info") if key in newest},
        "compressed": compressed and [compressed.format, len(compressed.data)]}


def main():
    given = arguments()
    rclpy.init()
    node = rclpy.create_node("reader")
    topics = topics_of(given.name, given.camera)
    quality = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE) if given.reliable else qos_profile_sensor_data
    reader = Reader(node, topics, {*given.topics, "diagnostics"}, quality)
    client = node.create_client(Trigger, f"/{given.name}/trigger")
    found = client.wait_for_service(timeout_sec=given.find)
    begin = time.monotonic()
    answers = call(node, client, given.calls if found else 0)
    took = time.monotonic() - begin
    before = reader.counts()
    end = time.monotonic() + (given.measure or given.seconds)
    while time.monotonic() < end and (given.measure or any(len(reader.numbers[key]) - before[key] < 3 for key in given.topics)):
        rclpy.spin_once(node, timeout_sec=0.1)
    if found:  # the graph of nodes may come after the topics
        wait_for_node(node, ("slsd", f"/{given.name}"), end)
    endpoints = [[topic, info.node_namespace, info.node_name, str(info.topic_type_hash)]
                 for _, topic in topics.values() for info in node.get_publishers_info_by_topic(topic)]
    json.dump({
        "rmw": rclpy.get_rmw_implementation_identifier(), "found": found, "answers": answers, "seconds": took,
        "nodes": node.get_node_names_and_namespaces(), "endpoints": endpoints, "counts": reader.counts(),
        "sent": {key: numbers[-1] - numbers[0] + 1 if numbers else 0 for key, numbers in reader.numbers.items()},
        "services": node.get_service_names_and_types_by_node("slsd", f"/{given.name}") if found else [],
        **described(reader.newest)}, sys.stdout)
    node.destroy_node()
    rclpy.shutdown()


main()
