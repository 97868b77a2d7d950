#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service on a GigE Vision camera that loses its power, its network or its controller while it scans."""
import json
import time
import unittest

from gige_double import Double, service_on
from recovery import LOST, scan_until_it_fails, scan_until_it_works, soon
from service import slsd, wait_until

FOR_EVER = 1000000


class Gige(unittest.TestCase):
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

    def recovers(self, strike, mend):
        """Scans fail, each with one clear error, from the strike on; and work again after it is mended."""
        with self.service.client() as client:
            opened = client.call("status")[0]["cameras"][0]["opened"]
            strike()
            error = scan_until_it_fails(client, timeout_ms=3000)
            self.assertIn(error.name, LOST, str(error))
            mend()
            seconds, _, result = scan_until_it_works(client)
            self.assertGreater(result["points"], 2000)
            status, _ = client.call("status")
        print(f"{self.id()}: {seconds:.2f} s to a cloud, opened {status['cameras'][0]['opened'] - opened} times")
        self.assertIsNone(self.service.process.poll())

    def told(self, command):
        return lambda: self.double.tell(command)

    def test_scans_the_plane(self):
        with self.service.client() as client:
            result = scan_until_it_works(client)[2]
            status, _ = client.call("status")
        self.assertGreater(result["points"], 2000)
        self.assertEqual(status["cameras"][0]["driver"], "aravis")

    def test_takes_two_exposures(self):
        """The double takes them, and its chunks have them, but its scene is as bright in both."""
        double = Double()
        self.addCleanup(double.close)
        with service_on(double, "exposures_us = [2000, 8000]") as service, service.client() as client:
            result = scan_until_it_works(client)[2]
            lost = client.call("status")[0]["cameras"][0]["frames_lost"]
        self.assertGreater(result["points"], 2000)
        self.assertEqual(result["exposures"]["camera"]["merged"], 1)
        self.assertIn("1.00 times as bright", result["exposures"]["camera"]["problem"])
        self.assertEqual(lost, 0)

    def test_scans_again_after_a_power_failure(self):
        self.recovers(self.double.unplug, self.double.plug_in)

    def test_scans_again_after_a_failure_of_the_network(self):
        self.recovers(self.told("gone 1"), self.told("gone 0"))

    def test_scans_again_when_another_application_is_gone(self):
        self.recovers(self.told("occupy 1"), self.told("occupy 0"))

    def test_scans_again_when_a_device_sends_frames_again(self):
        self.recovers(self.told("silent 1"), self.told("silent 0"))

    def test_outlasts_a_stall_of_two_seconds(self):
        """Two frames are missed by then. A busy machine may miss more, so the limit of 2 would be a race."""
        double = Double()
        self.addCleanup(double.close)
        with service_on(double, "missed_frames_max = 20") as service, service.client() as client:
            scan_until_it_works(client)
            double.tell("stall 2000")
            result, _ = client.call("scan", timeout_ms=600000)
        self.assertGreater(result["points"], 2000)

    def test_makes_no_cloud_of_a_frame_that_says_it_is_another(self):
        for fault, name in (("misexpose", "mismatch"), ("misgain", "mismatch"), ("cut", "frame_torn"),
                            ("garble", "frame_torn")):
            self.double.tell(f"{fault} {FOR_EVER}")
            with self.service.client() as client:
                for _ in range(3):
                    scan_until_it_fails(client, name)
                self.double.tell(f"{fault} 0")
                scan_until_it_works(client)

    def test_ends_a_scan_under_way(self):
        with self.service.client() as client:
            with soon(0.1, self.double.tell, "gone 1"):
                error = scan_until_it_fails(client, timeout_ms=3000)
            self.assertIn(error.name, LOST, str(error))
            begin = time.monotonic()
            client.call("status")  # nobody else is held up meanwhile
            self.assertLess(time.monotonic() - begin, 30)
            self.double.tell("gone 0")
            scan_until_it_works(client)

    def test_is_absent_while_nobody_answers(self):
        self.double.unplug()
        with self.service.client() as client:
            def state():
                return client.call("status")[0]["cameras"][0]["state"]
            wait_until(lambda: state() == "absent", "the loss")
            end = time.monotonic() + 1.5
            while time.monotonic() < end:
                self.assertEqual(state(), "absent")
            self.double.plug_in()
            scan_until_it_works(client)

    def test_is_listed(self):
        wait_until(self.is_seen, "the camera in the list, with who controls it")

    def is_seen(self):
        """Once; a busy camera may answer later than the list waits."""
        result = slsd("--list", "--json", "--config", self.service.file)
        seen = [one for one in json.loads(result.stdout)["cameras"] if one.get("address") == self.double.address]
        self.assertLessEqual(len(seen), 1, result.stdout)
        if seen:
            self.assertEqual(seen[0]["configured_as"], "camera")
        return bool(seen) and "a program on this host" in seen[0].get("controlled_by", "")


if __name__ == "__main__":
    unittest.main()
