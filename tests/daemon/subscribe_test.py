#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Subscriptions to the clouds of the whole service."""
import ctypes
import json
import os
import resource
import socket
import time
import unittest

from client import RpcError
from point_cloud import vertices
from service import Service, wait_until


PR_CAPBSET_DROP, CAP_SYS_ADMIN, CAP_SYS_RESOURCE = 24, 21, 24


class Subscription(unittest.TestCase):
    def test_gives_every_cloud_to_who_reads(self):
        with Service() as service, service.client() as client:
            client.call("subscribe", format="ply")
            events = [client.receive() for _ in range(5)]
            frames = [message["params"]["frame"] for message, _ in events]
            self.assertEqual(frames, sorted(set(frames)))
            for message, cloud in events:
                self.assertEqual(message["method"], "cloud")
                self.assertEqual(len(vertices(cloud)), message["params"]["points"])
            client.call("scan")
            client.call("unsubscribe")
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["subscribers"] == 0, "no subscriber")

                def rests():
                    before = other.call("status")[0]["scans"]["succeeded"]
                    time.sleep(0.5)
                    return other.call("status")[0]["scans"]["succeeded"] == before
                wait_until(rests, "an end of the scans")  # some may be under way still

    def test_a_cloud_whose_descriptor_cannot_be_sent_is_told_as_an_event(self):
        """As the kernel limits how many a user's processes may have under way, by the sender's limit of open files."""
        def limit():
            resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
            for capability in (CAP_SYS_ADMIN, CAP_SYS_RESOURCE):  # root's processes would not be limited
                ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
        here, there = socket.socketpair()
        with here, there, Service(preexec=limit) as service, service.client() as client, open(os.devnull, "rb") as file:
            service.wait_ready()
            for _ in range(5):
                socket.send_fds(here, [b"x"], [file.fileno()] * 20)
            client.call("subscribe", transport="memfd")
            for _ in range(3):
                event, _ = client.receive()
                self.assertEqual((event["method"], event["params"]["error"]["data"]["name"]), ("scan_failed", "no_space"))
                self.assertNotIn("id", event)
            client.call("status")
            with self.assertRaises(RpcError) as failed:
                client.call("scan", transport="memfd")
            self.assertEqual(failed.exception.name, "no_space")

    def test_last_request_of_a_subscriber_is_answered(self):
        for _ in range(3):
            with Service() as service, service.client() as client:
                client.call("subscribe")
                client.receive()
                client.last_id += 1
                client.send(json.dumps({"jsonrpc": "2.0", "id": client.last_id, "method": "scan"}).encode())
                client.socket.shutdown(socket.SHUT_WR)
                self.assertGreater(client.reply()[0]["points"], 0)
                for _ in range(3):  # and it listens still
                    self.assertIn("method", client.receive()[0])

    def test_slow_reader_loses_clouds_and_holds_nobody_up(self):
        with Service() as service, service.client() as slow, service.client() as quick:
            slow.call("subscribe")
            quick.call("subscribe")
            for _ in range(20):
                quick.receive()
            with service.client() as other:
                other.call("scan")
            lost = [slow.receive()[0]["params"].get("lost", 0) for _ in range(10)]
            self.assertGreater(sum(lost), 0)
            numbers = [slow.receive()[0]["params"]["frame"] for _ in range(3)]
            self.assertEqual(numbers, sorted(set(numbers)))

    def test_reader_that_stopped_is_dropped(self):
        with Service(server="send_timeout_ms = 300") as service, service.client() as stuck:
            stuck.call("subscribe")
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["clients"] == 1, "the stuck client to be dropped")

    def test_rate_is_kept(self):
        with Service() as service, service.client() as client:
            begin = time.monotonic()
            client.call("subscribe", rate_hz=4)
            for _ in range(5):
                client.receive()
            self.assertGreater(time.monotonic() - begin, 0.9)

    def test_recorded_frames_leave_the_processor_time(self):
        with Service() as service, service.client() as client:
            client.call("subscribe")
            times = [client.receive()[0]["params"]["received_monotonic_us"] for _ in range(8)]
            self.assertGreater(times[-1] - times[0], 7e5 / 2)
        with Service(camera="rate_hz = 1000") as service, service.client() as client:  # is paced by itself
            client.call("subscribe")
            client.receive()

    def test_tells_of_failed_scans(self):
        faults = [f"drop@{capture}" for capture in range(2, 200, 2)]  # one may be passed over for a newer cloud
        with Service(camera=f"faults = {faults}") as service, service.client() as client:
            client.call("subscribe")
            methods = set()
            while methods != {"scan_failed", "cloud"}:
                methods.add(client.receive()[0]["method"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
