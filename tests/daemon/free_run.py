#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Measures a service on a double of a camera of 1600x1200: clouds per second at a subscriber, with an account of every
frame, and how long a cloud takes from its frames' last byte into a client's hands. Needs SLSD_BIN and SLSD_SCENE, as
the tests of the service.

Exit status 1 where a frame was lost without being counted.
"""
import argparse
import contextlib
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

from service import BIN, SCENE, Service, wait_until
from v4l2_double import Double, service_on

GIGE_CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "aravis"
id = "{address}"
trigger = "{trigger}"
rate_hz = {rate_hz}
exposure_us = 1000.0
[calibration]
file = "{scene}/calibration.yml"
[server]
socket = "slsd.sock"
"""


class V4l2Camera:
    def __init__(self, rate_hz):
        self.double = Double(rate_hz)
        self.service = service_on(self.double)

    def stop_frames(self):
        self.double.tell("stall 60000")

    def close(self):
        self.double.close()


class GigeCamera:
    def __init__(self, rate_hz, trigger="free_run"):
        self.folder = tempfile.TemporaryDirectory()
        pathlib.Path(self.folder.name, "frame.png").symlink_to(SCENE / "frame.png")
        self.process = subprocess.Popen([BIN / "gige-camera", "--images", self.folder.name], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        self.service = Service(configuration=GIGE_CONFIGURATION.format(
            scene=SCENE, address=self.process.stdout.readline().strip(), trigger=trigger,
            rate_hz=rate_hz if trigger == "free_run" else 0.0))

    def stop_frames(self):
        self.process.stdin.write("stall 60000\n")
        self.process.stdin.flush()

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()
        self.folder.cleanup()


CAMERAS = {"v4l2": V4l2Camera, "gige": GigeCamera, "gige-software": lambda rate_hz: GigeCamera(rate_hz, "software")}


def latency_ms(description):
    """From the frames' last byte to now, when the client has the whole cloud."""
    return time.monotonic_ns() / 1e6 - description["received_monotonic_us"] / 1e3


def times_line(what, clouds):
    """clouds: pairs of a scan's description and its latency in the client's hands."""
    hands = statistics.median(latency for _, latency in clouds)
    socket = statistics.median(description["latency_ms"] for description, _ in clouds)
    decode = statistics.median(description["decode_ms"] for description, _ in clouds)
    return (f"{what}: decode {decode:.2f} ms, to the socket {socket:.2f} ms, into the client's hands {hands:.2f} ms, "
            f"{hands / decode:.2f} times the decode (medians of {len(clouds)})")


def measure_scans(service, count):
    with service.client() as client:
        clouds = []
        for _ in range(count):
            description, _ = client.call("scan", timeout_ms=30000)
            clouds.append((description, latency_ms(description)))
    print(times_line("scans asked for", clouds))


def receive_until_quiet(client, take):
    with contextlib.suppress(TimeoutError):
        while True:
            take(client.receive()[0])


def measure_free_run(camera, seconds):
    clouds = []
    lost = failed = failed_last = 0

    def take(message):
        nonlocal lost, failed, failed_last
        if message.get("method") == "cloud":
            clouds.append((message["params"], latency_ms(message["params"])))
            lost += message["params"]["lost"]
            failed += failed_last
            failed_last = 0
        failed_last += message.get("method") == "scan_failed"  # those after the last cloud: there are no frames any more

    with camera.service.client() as client, camera.service.client() as other:
        before, _ = other.call("status")
        client.call("subscribe")
        while not clouds:
            take(client.receive()[0])
        begin = time.monotonic()
        while time.monotonic() - begin < seconds:
            take(client.receive()[0])
        elapsed, in_time = time.monotonic() - begin, len(clouds) - 1
        camera.stop_frames()
        client.socket.settimeout(2)
        receive_until_quiet(client, take)
        after, _ = other.call("status")
    numbers = clouds[-1][0]["frame"] - before["cameras"][0]["frames"] - before["cameras"][0]["frames_lost"] + 1
    skipped = after["scans"]["skipped"] - before["scans"]["skipped"]
    camera_lost = after["cameras"][0]["frames_lost"] - before["cameras"][0]["frames_lost"] - failed_last
    uncounted = numbers - len(clouds) - lost - skipped - camera_lost
    print(f"free run: {in_time / elapsed:.1f} clouds/s at a subscriber; {numbers} frames: {len(clouds)} clouds, "
          f"{skipped} skipped for newer ones, {lost} lost at the subscriber, {camera_lost} lost by the camera, "
          f"{failed} scans failed; {uncounted} not counted")
    print(times_line("free run", clouds))
    return uncounted == 0


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--camera", choices=CAMERAS, default="v4l2")
    arguments.add_argument("--rate-hz", type=float, default=120)
    arguments.add_argument("--seconds", type=float, default=10)
    arguments.add_argument("--scans", type=int, default=100)
    arguments = arguments.parse_args()
    camera = CAMERAS[arguments.camera](arguments.rate_hz)
    with camera.service as service:
        with service.client() as client:
            wait_until(lambda: client.call("status")[0]["ready"], "the camera")
        measure_scans(service, arguments.scans)
        counted = measure_free_run(camera, arguments.seconds)
    camera.close()
    return 0 if counted else 1


if __name__ == "__main__":
    sys.exit(main())
