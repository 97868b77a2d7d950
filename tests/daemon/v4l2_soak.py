#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Unplugs and plugs in a V4L2 camera again and again while the service scans, with a fault before each, drawn from
those named with commas. With --deaths, its stream dies instead, while its device stays and answers: as uvcvideo's
after a bad cable; while clients scan, scan with short deadlines, or nobody asks. Needs SLSD_BIN and SLSD_SCENE, as the
tests of the service.

Exit status 1 where a life did not end in a scan, the service's descriptors or memory grew, or a stream that died was
not back in 3 s.
"""
import argparse
import random
import sys
import threading
import time

from client import RpcError
from recovery import descriptors, openings, resident_kib, scan_until_it_works, scan_until_opened_again
from v4l2_double import Double, service_on

FAULTS = ["drop 1", "flag 1", "short 1", "age 1", "eio 1", "eio 1000000", "stall 300", "die"]
ASKS = {"scans": {"timeout_ms": 5000}, "short scans": {"timeout_ms": 100}, "idle": None}
BACK_S = 3.0
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


def die_once(double, client, params):
    """One death; the seconds until the camera is open again and, where anyone asks, a scan works."""
    opened = openings(client)
    double.tell("die")
    begin = time.monotonic()
    if params is None:
        while openings(client) == opened:
            time.sleep(0.01)
    else:
        scan_until_opened_again(client, opened, **params)
        scan_until_it_works(client)
    return time.monotonic() - begin


def soak_deaths(deaths):
    double = Double()
    good = True
    with service_on(double) as service, service.client() as client:
        for name, params in ASKS.items():
            scan_until_it_works(client)
            seconds = sorted(die_once(double, client, params) for _ in range(deaths))
            good = good and seconds[-1] <= BACK_S
            print(f"a stream that died, {name}: back {len(seconds)} of {deaths} times; median "
                  f"{seconds[len(seconds) // 2]:.3f} s, longest {seconds[-1]:.3f} s, allowed {BACK_S} s", flush=True)
    double.close()
    return good


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lives", type=int, default=1000, help="more than 5")
    arguments.add_argument("--faults", default=",".join(FAULTS))
    arguments.add_argument("--deaths", type=int, help="so many for each way of asking, and no lives")
    arguments = arguments.parse_args()
    if arguments.deaths:
        return 0 if soak_deaths(arguments.deaths) else 1
    return 0 if soak(arguments.lives, arguments.faults.split(",")) else 1


if __name__ == "__main__":
    sys.exit(main())
