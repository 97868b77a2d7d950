#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Strikes a GigE Vision camera again and again at random moments while the service scans, with one kind of fault after
another, and measures how long it takes from its end to a cloud. Needs SLSD_BIN and SLSD_SCENE, as the tests of the
service. Kinds that are named with commas run beside one another, each on a camera and a service of its own.

Exit status 1 where a life did not end in a scan, or a service's descriptors, threads or memory grew.
"""
import argparse
import concurrent.futures
import random
import sys
import threading
import time

from client import RpcError
from gige_double import Double, service_on
from recovery import descriptors, resident_kib, scan_until_it_works, threads

# A fault and its end, as commands of the double; None: its power is cut, or it ends by itself.
KINDS = {"power": (None, None), "network": ("gone 1", "gone 0"), "controller": ("occupy 1", "occupy 0"),
         "silence": ("silent 1", "silent 0"), "stall": ("stall 800", None), "blip": ("blip 300", None)}
QUICK = "frame_timeout_ms = 500"
WARM_UP_LIVES = 50  # sessions that overlap while they close leave the allocator with more than one needs
SETTLE_S = 8  # sessions with a camera that is gone take seconds to close
GROWTH_MAX = 1.1


def strike(double, kind):
    double.tell(KINDS[kind][0]) if KINDS[kind][0] else double.unplug()


def mend(double, kind):
    fault, end = KINDS[kind]
    if not fault:
        double.plug_in()
    elif end:
        double.tell(end)


def live_once(double, client, kind, chance):
    """One life; the seconds from the end of the fault to a cloud."""
    hand = threading.Timer(chance.uniform(0, 0.1), strike, [double, kind])
    hand.start()
    failed = False
    while not failed:
        try:
            client.call("scan", timeout_ms=1000)
        except RpcError:
            failed = not hand.is_alive()
    hand.join()
    time.sleep(chance.uniform(0, 0.1))
    mend(double, kind)
    return scan_until_it_works(client)[0]


def measure(service):
    return descriptors(service.process), threads(service.process), resident_kib(service.process)


def soak(kind, lives, seconds):
    """The line of the report, and whether all is well."""
    double = Double()
    chance = random.Random(7)
    recoveries = []
    end = time.monotonic() + seconds
    with service_on(double, QUICK) as service, service.client() as client:
        scan_until_it_works(client)
        while len(recoveries) < lives + WARM_UP_LIVES and time.monotonic() < end:
            if len(recoveries) == WARM_UP_LIVES:
                time.sleep(SETTLE_S)
                before = measure(service)
            recoveries.append(live_once(double, client, kind, chance))
        time.sleep(SETTLE_S)
        after = measure(service)
    double.close()
    recoveries = sorted(recoveries[WARM_UP_LIVES:])
    late = sum(recovery > 2 for recovery in recoveries)
    print(f"{kind}: {len(recoveries)} recoveries; from the end of the fault to a cloud: median "
          f"{recoveries[len(recoveries) // 2]:.3f} s, longest {recoveries[-1]:.3f} s, {late} above 2 s; descriptors "
          f"{before[0]} to {after[0]}, threads {before[1]} to {after[1]}, memory {before[2]} to {after[2]} KiB", flush=True)
    return after[0] <= before[0] and after[1] <= before[1] and after[2] <= before[2] * GROWTH_MAX


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lives", type=int, default=1000, help="of each kind")
    arguments.add_argument("--kinds", default=",".join(KINDS))
    arguments.add_argument("--seconds", type=float, default=36000, help="an end to it, for each kind")
    arguments = arguments.parse_args()
    kinds = arguments.kinds.split(",")
    with concurrent.futures.ThreadPoolExecutor(len(kinds)) as pool:
        well = list(pool.map(lambda kind: soak(kind, arguments.lives, arguments.seconds), kinds))
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
