#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Unplugs and plugs in a V4L2 camera again and again while the service scans, with a fault before each, then counts the
clouds that a subscriber gets of a quick one. Needs SLSD_BIN and SLSD_SCENE, as the tests of the service.

Exit status 1 where a life did not end in a scan, or the service's descriptors or memory grew.
"""
import argparse
import pathlib
import random
import sys
import threading
import time

from client import RpcError
from v4l2_double import Double, scan_until_it_works, service_on

FAULTS = ["drop 1", "flag 1", "short 1", "age 1", "eio 1", "eio 1000000", "stall 300"]
WARM_UP_LIVES = 5
GROWTH_MAX = 1.1


def resident_kib(process):
    with open(f"/proc/{process.pid}/smaps_rollup", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("Rss:"))


def descriptors(process):
    return len(list(pathlib.Path(f"/proc/{process.pid}/fd").iterdir()))


def live_once(double, client, chance):
    """One life: a fault, the plug drawn, and back; the seconds until a scan works."""
    def strike():
        double.tell(chance.choice(FAULTS))
        time.sleep(chance.uniform(0, 0.05))
        double.tell("unplug")
    hand = threading.Timer(chance.uniform(0, 0.1), strike)
    hand.start()
    lost = False
    while not lost:
        try:
            client.call("scan", timeout_ms=1000)
        except RpcError as error:
            lost = error.name in ("disconnected", "timeout") and not hand.is_alive()
    hand.join()
    time.sleep(chance.uniform(0, 0.1))
    double.tell("replug")
    return scan_until_it_works(client)[0]


def soak(lives):
    double = Double()
    chance = random.Random(5)
    seconds = []
    with service_on(double) as service, service.client() as client:
        client.call("scan")
        for life in range(lives):
            if life == WARM_UP_LIVES:
                before = descriptors(service.process), resident_kib(service.process)
            seconds.append(live_once(double, client, chance))
        after = descriptors(service.process), resident_kib(service.process)
    double.close()
    seconds.sort()
    print(f"{len(seconds)} recoveries of {lives}; from the plug to a cloud: median {seconds[len(seconds) // 2]:.3f} s, "
          f"longest {seconds[-1]:.3f} s; descriptors {before[0]} to {after[0]}, memory {before[1]} to {after[1]} KiB")
    return after[0] <= before[0] and after[1] <= before[1] * GROWTH_MAX


def measure_rate(rate_hz, seconds):
    double = Double(rate_hz)
    with service_on(double) as service, service.client() as client:
        client.call("subscribe")
        client.receive()
        begin = time.monotonic()
        clouds = lost = failed = 0
        while time.monotonic() - begin < seconds:
            message, _ = client.receive()
            clouds += message.get("method") == "cloud"
            lost += message["params"].get("lost", 0)
            failed += message.get("method") == "scan_failed"
        elapsed = time.monotonic() - begin
    double.close()
    print(f"a camera of {rate_hz:g} Hz: {clouds / elapsed:.1f} clouds/s at a subscriber, {lost} lost there, {failed} scans failed")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lives", type=int, default=1000)
    arguments.add_argument("--rate-hz", type=float, default=120)
    arguments.add_argument("--seconds", type=float, default=10)
    arguments = arguments.parse_args()
    if arguments.seconds > 0:
        measure_rate(arguments.rate_hz, arguments.seconds)
    return 0 if arguments.lives <= WARM_UP_LIVES or soak(arguments.lives) else 1


if __name__ == "__main__":
    sys.exit(main())
