#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service on a monitor of a real X server, which is plugged out and in, and ends, while it scans."""
import collections
import json
import os
import random
import sys
import threading
import time
import unittest

from client import RpcError
from recovery import LOST, processor_seconds, resident_kib, scan_until_it_fails, scan_until_it_works
from service import SCENE, Service, slsd, wait_until
from x_server import XServer, can_start

CANNOT_START = 77
LIVES = int(os.environ.get("SLSD_TEST_REPLUGS", "4"))
STILL_S = float(os.environ.get("SLSD_TEST_STILL_S", "2"))
STILL_SHARE_MAX = 0.1  # a redraw at each refresh takes several times that
PLACE = (1024, 0, 1280, 800)  # of DUMMY1 on the desktop
WARM_UP = max(1, LIVES // 10)  # times after which the allocator and the graphics driver have what they keep
MEMORY_KIB = 16384  # more than they still come and go by
CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[projector]
driver = "glfw"
monitor = "DUMMY1"
[[camera]]
name = "camera"
driver = "file"
path = "{scene}/frame.png"
[calibration]
file = "{scene}/calibration.yml"
[scan]
timeout_ms = 600000
reopen_first_ms = 20
reopen_longest_ms = 50
[server]
socket = "slsd.sock"
""".format(scene=SCENE)


class Scans:
    """Scans 10 times a second, on and on."""

    def __init__(self, service):
        self.service = service
        self.clouds = []  # when the last byte of its frame was there, in seconds of the monotonic clock
        self.errors = collections.Counter()
        self.thread = threading.Thread(target=self.run)
        self.running = True

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.running = False
        self.thread.join()

    def run(self):
        with self.service.client() as client:
            due = time.monotonic()
            while self.running:
                time.sleep(max(0, due - time.monotonic()))
                due = max(due + 0.1, time.monotonic())
                try:
                    result, _ = client.call("scan", timeout_ms=2000)
                except RpcError as error:
                    self.errors[error.name] += 1
                    continue
                if result["points"] <= 2000:
                    self.errors[f"a cloud of {result['points']} points"] += 1
                    continue
                self.clouds.append(result["received_monotonic_us"] / 1e6)


class Projector(unittest.TestCase):
    def setUp(self):
        self.server = XServer()
        self.server.plug()
        self.addCleanup(lambda: self.server.close())
        self.chance = random.Random(3)
        self.dark = []  # from when to when the projector was unplugged
        self.service = Service(configuration=CONFIGURATION, environment={"DISPLAY": self.server.display})

    def start(self):
        self.service.start()
        self.addCleanup(self.service.__exit__)

    def projector(self, client):
        return client.call("status")[0]["projector"]

    def test_scans_again_when_plugged_in_again(self):
        self.start()
        with self.service.client() as client:
            scan_until_it_works(client)
            pattern = self.server.screenshot(*PLACE)
            self.assertGreater(pattern.count(b"\xff"), 100000)
            with Scans(self.service) as scans:
                worst = max(self.live(scans, pattern) for _ in range(WARM_UP))
                before = resident_kib(self.service.process)
                worst = max([worst, *(self.live(scans, pattern) for _ in range(LIVES - WARM_UP))])
            after = resident_kib(self.service.process)
            self.assertEqual(self.projector(client)["device"], "DUMMY1")
        wrong = [scan for scan in scans.clouds if any(off < scan < on for off, on in self.dark)]
        print(f"{LIVES} times unplugged under {len(scans.clouds)} clouds and {sum(scans.errors.values())} errors "
              f"{dict(scans.errors)}, 10 scans a second: {LIVES} recoveries, {worst:.2f} s from the plug to a cloud at worst; "
              f"{len(wrong)} clouds from the dark; memory {before} KiB before, {after} KiB after")
        self.assertEqual(wrong, [])
        self.assertLessEqual(set(scans.errors), set(LOST))
        self.assertLess(after - before, MEMORY_KIB)
        self.assertIsNone(self.service.process.poll())

    def live(self, scans, pattern):
        """Pulls the plug and puts it in again. The seconds until there is a cloud, and the pattern is on the screen."""
        time.sleep(self.chance.uniform(0, 0.3))
        self.server.unplug()
        off = time.monotonic()
        time.sleep(self.chance.uniform(0, 0.3))
        on = time.monotonic()
        self.server.plug()
        plugged = time.monotonic()  # xrandr changes the desktop more than once, and each may take the window away again
        self.dark.append((off, on))
        wait_until(lambda: scans.clouds and scans.clouds[-1] > plugged, "a cloud")
        seconds = next(cloud for cloud in scans.clouds if cloud > on) - on
        self.assertTrue(self.server.screenshot(*PLACE) == pattern, "the pattern is not what the screen shows")
        return seconds

    def test_works_for_no_refresh_while_a_still_pattern_shows(self):
        self.start()
        with self.service.client() as client:
            scan_until_it_works(client)
        before = processor_seconds(self.service.process)
        time.sleep(STILL_S)
        share = (processor_seconds(self.service.process) - before) / STILL_S
        print(f"{100 * share:.2f} % of a processor while a still pattern shows for {STILL_S:.0f} s")
        self.assertLess(share, STILL_SHARE_MAX)

    def test_comes_up_without_a_display_and_outlives_it(self):
        self.server.close()
        self.start()
        with self.service.client() as client:
            wait_until(lambda: "cannot connect to the X server" in self.projector(client).get("problem", ""), "the reason")
            error = scan_until_it_fails(client, timeout_ms=1000)
            self.assertEqual(error.name, "timeout")
            self.assertRegex(str(error), "cannot connect to the X server|used up its time")
            for _ in range(2):
                self.server = XServer(self.server.display)
                self.server.plug()
                scan_until_it_works(client)
                self.server.close()
                wait_until(lambda: self.projector(client)["state"] != "ready", "the loss")

    def test_check_and_list_name_the_monitor(self):
        environment = {**os.environ, "DISPLAY": self.server.display}
        listed = slsd("--list", "--config", self.service.file, env=environment)
        self.assertIn("monitor DUMMY1, 1280x800 at 59.81 Hz, +1024+0", listed.stdout)
        monitors = json.loads(slsd("--list", "--json", "--config", self.service.file, env=environment).stdout)["monitors"]
        self.assertEqual([(monitor["name"], monitor["primary"]) for monitor in monitors],
                         [("DUMMY0", True), ("DUMMY1", False)])
        checked = slsd("--check", "--config", self.service.file, env=environment)
        self.assertIn("ok       projector: monitor DUMMY1", checked.stdout)
        self.assertIn("its native size is 1024x768", checked.stdout)
        self.assertEqual(checked.returncode, 0)
        self.server.unplug()
        checked = slsd("--check", "--config", self.service.file, env=environment)
        self.assertIn("the monitor \"DUMMY1\" is plugged in, but off", checked.stdout)
        self.assertEqual(checked.returncode, 1)
        self.service.configure(configuration=CONFIGURATION.replace('"glfw"', '"glfw"\nenable_output = true'))
        checked = slsd("--check", "--config", self.service.file, env=environment)
        self.assertIn("it is off: slsd sets it", checked.stdout)
        self.assertEqual(checked.returncode, 0)


if __name__ == "__main__":
    if not can_start():
        sys.exit(CANNOT_START)
    unittest.main(verbosity=2)
