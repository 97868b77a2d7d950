#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The service on Aravis' own fake camera, which others wrote: at a command and running freely, and beside it
arv-camera-test, which takes frames of the same camera. In a network of its own, where it can have one.

--frames N takes so many in each mode, and prints how many came. The programs are looked for in the folder that
SLSD_ARAVIS_TOOLS names, and in PATH. Status 77 where they are nowhere, or no network can be had.
"""
import argparse
import collections
import contextlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
import unittest

from own_network import enter_own_network, skip

ADDRESS = "127.0.0.1"
SERIAL = "SLSD01"
CONFIGURATION = """
[projector]
driver = "headless"
[[camera]]
name = "camera"
driver = "aravis"
id = "{address}"
trigger = "{trigger}"
[server]
socket = "slsd.sock"
"""


def tool(name):
    folder = os.environ.get("SLSD_ARAVIS_TOOLS")
    own = pathlib.Path(folder, name) if folder else None
    found = str(own) if own and own.exists() else shutil.which(name)
    return found or skip(f"{name} of the package aravis-tools is neither in SLSD_ARAVIS_TOOLS nor in PATH")


class AravisFake(unittest.TestCase):
    frames = 30

    @contextlib.contextmanager
    def fake(self):
        """A camera that nobody has set yet."""
        process = subprocess.Popen([tool("arv-fake-gv-camera-0.8"), "-i", ADDRESS, "-s", SERIAL])
        try:
            yield
        finally:
            process.kill()
            process.wait()

    def take_frames(self, trigger):
        """The frames that came, and what became of the others."""
        errors = collections.Counter()
        with Service(configuration=CONFIGURATION.format(address=ADDRESS, trigger=trigger)) as service:
            with service.client() as client:
                wait_until(lambda: client.call("status")[0]["cameras"][0]["state"] == "ready", "the camera")
                for _ in range(self.frames):
                    try:
                        frame, pixels = client.call("frame", format="raw", timeout_ms=20000)
                        self.assertEqual(len(pixels), frame["width_px"] * frame["height_px"])
                        errors["none"] += 1
                    except RpcError as error:
                        errors[str(error)] += 1
            log = service.log_text()
        self.assertIn("device_clock", log)
        return errors.pop("none", 0), errors

    def take_by_camera_test(self, *arguments):
        """The frames that arv-camera-test takes while it is given a second for ten of them."""
        time.sleep(1)  # it looks for the camera only once
        result = subprocess.run([tool("arv-camera-test-0.8"), "-n", f"Aravis-{SERIAL}", "-w", "2048", "-h", "2048",
                                 "--duration", str(max(5, self.frames // 10)), *arguments],
                                capture_output=True, text=True, timeout=600, check=False)
        counts = dict(re.findall(r"(n_\w+)\s*= (\d+)", result.stdout))
        self.assertIn("n_completed_buffers", counts, result.stdout + result.stderr)
        return int(counts["n_completed_buffers"]), int(counts["n_failures"])

    def compare(self, trigger, *arguments):
        begin = time.monotonic()
        with self.fake():
            came, errors = self.take_frames(trigger)
        seconds = time.monotonic() - begin
        with self.fake():
            completed, failed = self.take_by_camera_test(*arguments)
        print(f"{trigger}: {came} of {self.frames} frames of 2048x2048 in {seconds:.1f} s; arv-camera-test: {completed} "
              f"of {completed + failed}", flush=True)
        self.assertEqual(came, self.frames, errors)
        self.assertGreater(completed, 0)

    def test_takes_each_frame_at_a_command(self):
        self.compare("software", "--software-trigger", "10")

    def test_takes_each_frame_of_a_free_run(self):
        self.compare("free_run")


if __name__ == "__main__":
    enter_own_network()
    tool("arv-fake-gv-camera-0.8")
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--frames", type=int, default=AravisFake.frames)
    known, rest = arguments.parse_known_args()
    AravisFake.frames = known.frames
    from client import RpcError
    from service import Service, wait_until
    unittest.main(argv=[sys.argv[0], *rest])
