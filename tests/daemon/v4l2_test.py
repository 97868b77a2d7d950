#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service on a V4L2 camera over FUSE, which is unplugged and plugged in again while it scans."""
import random
import sys
import time
import unittest

from recovery import LOST, openings, scan_until_it_fails, scan_until_it_works, scan_until_opened_again, soon
from service import wait_until
from v4l2_double import CANNOT_MOUNT, Double, can_mount, service_on

LIVES = 4
FOR_EVER = 1000000


class V4l2(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.double = Double()
        cls.service = service_on(cls.double).start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()
        cls.double.close()

    def setUp(self):
        with self.service.client() as client:
            scan_until_it_works(client)

    def tearDown(self):
        self.double.mend()

    def test_scans_the_plane(self):
        with self.service.client() as client:
            result = scan_until_it_works(client)[2]
            self.assertGreater(result["points"], 2000)
            status, _ = client.call("status")
        self.assertEqual(status["cameras"][0]["driver"], "v4l2")

    def test_takes_two_exposures(self):
        """The double takes them, but its scene is as bright in both."""
        double = Double()
        self.addCleanup(double.close)
        with service_on(double, "exposures_us = [2000, 8000]") as service, service.client() as client:
            result = scan_until_it_works(client)[2]
        self.assertGreater(result["points"], 2000)
        self.assertEqual(result["exposures"]["camera"]["merged"], 1)
        self.assertIn("1.00 times as bright", result["exposures"]["camera"]["problem"])

    def expect(self, name, fault, remedy, **params):
        """Scans fail with the name while the fault lasts; and work again after it."""
        self.double.tell(fault)
        with self.service.client() as client:
            scan_until_it_fails(client, name, **params)
            self.double.tell(remedy)
            scan_until_it_works(client)

    def test_names_each_fault_and_goes_on(self):
        self.expect("frame_torn", f"flag {FOR_EVER}", "flag 0")
        self.expect("frame_torn", f"short {FOR_EVER}", "short 0")
        self.expect("frame_late", f"stall {FOR_EVER}", "stall 0", timeout_ms=300)
        self.expect("disconnected", f"eio {FOR_EVER}", "eio 0")  # a scan tries again, until the driver counts as gone

    def test_a_stream_that_died_is_started_anew(self):
        for params in ({}, {"timeout_ms": 100}):
            with self.service.client() as client:
                opened = openings(client)
                self.double.tell("die")
                scan_until_opened_again(client, opened, **params)
                self.assertGreater(scan_until_it_works(client)[2]["points"], 2000)

    def test_a_stream_that_died_is_started_anew_though_nobody_scans(self):
        with self.service.client() as client:
            opened = openings(client)
            self.double.tell("die")
            wait_until(lambda: openings(client) > opened, "the camera")

    def test_scans_again_when_plugged_in_again(self):
        chance = random.Random(3)
        worst = 0.0
        with self.service.client() as client:
            for _ in range(LIVES):
                with soon(chance.uniform(0, 0.3), self.double.tell, "unplug"):
                    error = scan_until_it_fails(client, timeout_ms=1000)
                self.assertIn(error.name, LOST, str(error))
                time.sleep(chance.uniform(0, 0.5))
                self.double.tell("replug")
                seconds, _, result = scan_until_it_works(client)
                self.assertGreater(result["points"], 2000)
                worst = max(worst, seconds)
        print(f"from the plug to a cloud: {worst:.2f} s at worst of {LIVES}")
        self.assertIsNone(self.service.process.poll())


if __name__ == "__main__":
    if not can_mount():
        sys.exit(CANNOT_MOUNT)
    unittest.main()
