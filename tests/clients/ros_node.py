# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A node of ROS 2 by its own client library, with the middleware and sockets that are its defaults.

usage: ros_node.py NAME CAMERA CALLS [SECONDS [TOPIC...]]   what it sees of the scanner, as JSON

Reads the scanner's topics with sensors' QoS, calls its trigger CALLS times, and waits SECONDS (10) for those of points,
camera_info, image, compressed and depth that are named.
"""
import json
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_srvs.srv import Trigger


def main():
    name, camera, calls = sys.argv[1], sys.argv[2], int(sys.argv[3])
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 10
    awaited = sys.argv[5:]
    rclpy.init()
    node = rclpy.create_node("reader")
    topics = {"points": (PointCloud2, f"/{name}/points"), "camera_info": (CameraInfo, f"/{name}/{camera}/camera_info"),
              "image": (Image, f"/{name}/{camera}/image_raw"),
              "compressed": (CompressedImage, f"/{name}/{camera}/image_raw/compressed"),
              "depth": (Image, f"/{name}/{camera}/depth/image_raw"),
              "depth_info": (CameraInfo, f"/{name}/{camera}/depth/camera_info"),
              "diagnostics": (DiagnosticArray, "/diagnostics")}
    got, counts = {}, dict.fromkeys(topics, 0)

    def keep(key):
        def kept(message):
            got[key] = message
            counts[key] += 1
        return kept

    for key, (kind, topic) in topics.items():
        if not awaited or key in awaited or key == "diagnostics":
            node.create_subscription(kind, topic, keep(key), qos_profile_sensor_data)
    client = node.create_client(Trigger, f"/{name}/trigger")
    found = client.wait_for_service(timeout_sec=30)
    answers, begin = [], time.monotonic()
    for _ in range(calls if found else 0):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=15)
        answers.append([future.result().success, future.result().message] if future.done() else None)
    took = time.monotonic() - begin
    counted = dict(counts)
    end = time.monotonic() + seconds
    while time.monotonic() < end and (not awaited or any(counts[key] - counted[key] < 3 for key in awaited)):
        rclpy.spin_once(node, timeout_sec=0.1)
    points = got.get("points")
    endpoints = [[topic, info.node_namespace, info.node_name, str(info.topic_type_hash)]
                 for _, topic in topics.values() for info in node.get_publishers_info_by_topic(topic)]
    json.dump({
        "rmw": rclpy.get_rmw_implementation_identifier(), "found": found, "answers": answers, "seconds": took,
        "nodes": node.get_node_names_and_namespaces(), "endpoints": endpoints, "counts": counts,
        "services": node.get_service_names_and_types_by_node("slsd", f"/{name}") if found else [],
        "own_hash": str(node.get_publishers_info_by_topic("/rosout")[0].topic_type_hash),
        "points": points and {
            "frame_id": points.header.frame_id, "stamp": points.header.stamp.sec + 1e-9 * points.header.stamp.nanosec,
            "height": points.height, "width": points.width, "point_step": points.point_step, "row_step": points.row_step,
            "fields": [[f.name, f.offset, f.datatype, f.count] for f in points.fields], "is_dense": points.is_dense,
            "data": bytes(points.data).hex()},
        "pictures": {key: [got[key].width, got[key].height, got[key].encoding, len(got[key].data)]
                     for key in ("image", "depth") if key in got},
        "infos": {key: [got[key].width, got[key].height, list(got[key].k)] for key in ("camera_info", "depth_info") if key in got},
        "compressed": [got["compressed"].format, len(got["compressed"].data)] if "compressed" in got else None,
    }, sys.stdout)
    node.destroy_node()
    rclpy.shutdown()


main()
