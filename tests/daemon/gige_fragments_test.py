#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The service on a GigE Vision camera whose packets are larger than the network takes, and that sends them in fragments. In
a network of its own with Ethernet's usual MTU; status 77 where none can be had."""
import unittest

from own_network import enter_own_network

MTU_BYTES = 1500


class Fragments(unittest.TestCase):
    def setUp(self):
        self.double = Double("--breaks-up", "1")
        self.addCleanup(self.double.close)

    def log_of(self, camera, look):
        """What the service logs while `look` is done with a client."""
        with service_on(self.double, camera) as service:
            with service.client() as client:
                look(client)
            return service.log_text()

    def warns_once(self, camera, remedy):
        def try_to_scan(client):
            for _ in range(3):
                with contextlib.suppress(RpcError):
                    client.call("scan", format="ply", timeout_ms=2000)
        lines = [line for line in self.log_of(camera, try_to_scan).splitlines() if " fragments: " in line]
        self.assertEqual(len(lines), 1, lines)
        self.assertIn("fragments the camera's packets", lines[0])
        self.assertIn(remedy, lines[0])

    def test_packets_set_too_large_are_named_with_the_size_that_passes(self):
        self.warns_once("packet_bytes = 4000", "set packet_bytes to 1500 or less, or to 0")

    def test_a_camera_that_breaks_up_what_is_to_be_tried_whole_is_named(self):
        self.warns_once("", "set packet_bytes to 1500;")

    def test_the_remedy_helps_and_says_nothing(self):
        log = self.log_of(f"packet_bytes = {MTU_BYTES}", scan_until_it_works)
        self.assertNotIn("fragments", log)


if __name__ == "__main__":
    enter_own_network(MTU_BYTES)
    import contextlib

    from client import RpcError
    from gige_double import Double, service_on
    from recovery import scan_until_it_works
    unittest.main()
