#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What goes on while a scan waits: for a device that is absent, for one that hangs, for frames that get lost."""
import contextlib
import pathlib
import select
import signal
import socket
import tempfile
import time
import unittest

from client import RpcError
from point_cloud import vertices
from service import SCENE, Service, wait_until

NO_CAMERA = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "file"
path = "{missing}"
[calibration]
file = "{scene}/calibration.yml"
[server]
socket = "slsd.sock"
"""


def without_camera():
    return Service(configuration=NO_CAMERA.format(scene=SCENE, missing=SCENE / "no-such-frame.png"))


def milliseconds(call):
    begin = time.monotonic()
    call()
    return 1000 * (time.monotonic() - begin)


class WhileADeviceIsAbsent(unittest.TestCase):
    def test_nothing_else_waits_for_it(self):
        with without_camera() as service, service.client() as waiting, service.client() as other:
            waiting.request("scan", timeout_ms=600000)
            time.sleep(0.2)
            for method in ("settings", "pattern", "status", "reload"):
                times = [milliseconds(lambda: other.call(method)) for _ in range(5)]
                print(f"{method} while another's scan waits: {sorted(times)[2]:.1f} ms (median of {len(times)})")
                self.assertLess(min(times), 30000)  # of the 600000 that the scan waits

    def test_who_hangs_up_holds_nobody_up(self):
        with without_camera() as service, service.client() as other:
            def more_than_may_wait():
                with service.client() as client:
                    client.request("scan", timeout_ms=600000)
                    return other.call("status")[0]["scans"]["failed"].get("cancelled", 0) > 64
            wait_until(more_than_may_wait, "scans to end with their clients")
            wait_until(lambda: other.call("status")[0]["clients"] == 1, "the others to be gone")
            with self.assertRaises(RpcError) as caught:
                other.call("scan", timeout_ms=300)
            self.assertEqual(caught.exception.name, "timeout")

    def test_who_only_stops_sending_still_gets_the_answer(self):
        with without_camera() as service, service.client() as client:
            client.request("scan", timeout_ms=1000)
            client.socket.shutdown(socket.SHUT_WR)
            with self.assertRaises(RpcError) as caught:
                client.reply()
            self.assertEqual(caught.exception.name, "timeout")

    def test_each_scan_ends_at_its_own_deadline_and_names_the_device(self):
        with without_camera() as service, service.client() as first, service.client() as second:
            first.request("scan", timeout_ms=600000)
            time.sleep(0.2)
            with self.assertRaises(RpcError) as caught:
                second.call("scan", timeout_ms=500)
            self.assertEqual(caught.exception.name, "timeout")
            self.assertIn("camera camera", str(caught.exception))

    def test_a_hung_up_scan_leaves_the_next_one_whole(self):
        with Service(camera='faults = ["late@1"]') as service, service.client() as other:
            with service.client() as client:
                client.request("scan", timeout_ms=600000)
                wait_until(lambda: other.call("status")[0]["cameras"][0]["state"] == "capturing", "the camera")
            result, cloud = other.call("scan", timeout_ms=600000)
            self.assertEqual(len(vertices(cloud)), result["points"])


class LostFrames(unittest.TestCase):
    def test_are_taken_again_and_told(self):
        with Service(camera='faults = ["drop@1", "tear@2", "stale@3"]') as service, service.client() as client:
            result, cloud = client.call("scan", timeout_ms=600000)
            self.assertEqual(result["tries"], 4)
            self.assertEqual([lost["data"]["name"] for lost in result["lost_tries"]],
                             ["frame_dropped", "frame_torn", "frame_stale"])
            self.assertEqual(len(vertices(cloud)), result["points"])
            self.assertEqual(client.call("scan")[0]["tries"], 1)
            scans = client.call("status")[0]["scans"]
            self.assertEqual((scans["succeeded"], scans["failed"]), (2, {}))

    def test_end_in_the_name_of_what_happened(self):
        faults = [f"tear@{capture}" for capture in range(1, 400)]
        with Service(camera=f"faults = {faults}") as service, service.client() as client:
            service.wait_ready()
            with self.assertRaises(RpcError) as caught:
                client.call("scan", timeout_ms=1000)
            self.assertEqual(caught.exception.name, "frame_torn")
            self.assertIn("tries", str(caught.exception))


class Watchdog(unittest.TestCase):
    """A driver that never comes back has to end in a restart, however long clients are ready to wait."""

    def test_ping_is_withheld_while_a_driver_hangs(self):
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
            path = str(pathlib.Path(folder) / "notify")
            manager.bind(path)
            service = Service(camera='faults = ["hang@1"]',
                              environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "300000"})
            with service, service.client() as client, service.client() as other:
                client.request("scan", timeout_ms=600000)
                begin = time.monotonic()
                last_ping = begin
                while time.monotonic() - last_ping < 5:  # 50 pings of those that are sent else
                    self.assertLess(time.monotonic() - begin, 100, "pings go on while a driver hangs")
                    if select.select([manager], [], [], 1)[0] and b"WATCHDOG=1" in manager.recv(4096):
                        last_ping = time.monotonic()
                print(f"the last ping came {last_ping - begin:.1f} s after the driver hung")
                other.call("status")
                status, seconds = service.stop(signal.SIGTERM)
                self.assertEqual(status, 0)
                self.assertLess(seconds, 30)
                with contextlib.suppress(RpcError, ConnectionError):
                    client.reply()


if __name__ == "__main__":
    unittest.main(verbosity=2)
