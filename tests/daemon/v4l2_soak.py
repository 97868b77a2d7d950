#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Unplugs and plugs in a V4L2 camera again and again while the service scans, with a fault before each, drawn from
those named with commas. Needs SLSD_BIN and SLSD_SCENE, as the tests of the service.

Exit status 1 where a life did not end in a scan, or the service's descriptors or memory grew.
"""
import argparse
import random
import sys
import threading
import time

from client import RpcError
from recovery import descriptors, resident_kib, scan_until_it_works
from v4l2_double import Double, service_on

FAULTS = ["drop 1", "flag 1", "short 1", "age 1", "eio 1", "eio 1000000", "stall 300"]
WARM_UP_LIVES = 5
GROWTH_MAX = 1.1


def live_once(double, client, faults, chance):
    """One life: a fault, the plug drawn, and back; the seconds until a scan works."""
    def strike():
        double.tell(chance.choice(faults))
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


def soak(lives, faults):
    double = Double()
    chance = random.Random(5)
    seconds = []
    with service_on(double) as service, service.client() as client:
        scan_until_it_works(client)
        for life in range(lives):
            if life == WARM_UP_LIVES:
                before = descriptors(service.process), resident_kib(service.process)
            seconds.append(live_once(double, client, faults, chance))
        after = descriptors(service.process), resident_kib(service.process)
    double.close()
    seconds.sort()
    print(f"{', '.join(faults)}: {len(seconds)} recoveries of {lives}; from the plug to a cloud: median "
          f"{seconds[len(seconds) // 2]:.3f} s, longest {seconds[-1]:.3f} s; descriptors {before[0]} to {after[0]}, "
          f"memory {before[1]} to {after[1]} KiB")
    return after[0] <= before[0] and after[1] <= before[1] * GROWTH_MAX


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lives", type=int, default=1000, help="more than 5")
    arguments.add_argument("--faults", default=",".join(FAULTS))
    arguments = arguments.parse_args()
    return 0 if soak(arguments.lives, arguments.faults.split(",")) else 1


if __name__ == "__main__":
    sys.exit(main())
