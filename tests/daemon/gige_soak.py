#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Strikes a GigE Vision camera again and again at random moments while the service scans, with one kind of fault after
another, and measures how long it takes from its end to a cloud. Needs SLSD_BIN and SLSD_SCENE, as the tests of the
service. Kinds that are named with commas run beside one another, each on a camera and a service of its own.

With --openings it strikes nothing, but opens that often, each time with a new service, a camera that loses packets and
numbers its frames from 1 at each AcquisitionStart, scans once after each opening, and then --scans times more.

Exit status 1 where a life did not end in a scan, a service's descriptors, threads or memory grew, or a scan of the
openings failed.
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
POINTS_MIN = 2000


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


def scan_once(client):
    """Whether there is a cloud, how many tries of the scan lost their frame before, and the seconds."""
    begin = time.monotonic()
    try:
        result, _ = client.call("scan")
    except RpcError as error:
        print(f"scan: {error}", flush=True)
        return False, 0, time.monotonic() - begin
    return result["points"] > POINTS_MIN, result.get("tries", 1) - 1, time.monotonic() - begin


def tell(what, scans):
    """The line of the report, and whether all is well."""
    well = sum(cloud for cloud, _, _ in scans)
    times = sorted(seconds for _, _, seconds in scans)
    print(f"{what}: {well} of {len(scans)} scans gave a cloud, {sum(lost > 0 for _, lost, _ in scans)} of them at a later "
          f"try; median {times[len(times) // 2] * 1e3:.0f} ms, longest {times[-1] * 1e3:.0f} ms", flush=True)
    return well == len(scans)


def open_again_and_again(openings, scans, loss):
    double = Double("--restarts-ids", "1")
    double.tell(f"lose {loss}")
    first, more = [], []
    for opening in range(openings):
        with service_on(double) as service, service.client() as client:
            service.wait_ready()
            first.append(scan_once(client))
            for _ in range(scans if opening + 1 == openings else 0):
                more.append(scan_once(client))
    print(f"the camera: {double.status()}")
    double.close()
    well = tell("first after opening", first)
    return (not more or tell("more", more)) and well


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--lives", type=int, default=1000, help="of each kind")
    arguments.add_argument("--kinds", default=",".join(KINDS))
    arguments.add_argument("--seconds", type=float, default=36000, help="an end to it, for each kind")
    arguments.add_argument("--openings", type=int, default=0, help="open so often instead")
    arguments.add_argument("--scans", type=int, default=1000, help="after the last of the openings")
    arguments.add_argument("--loss", type=float, default=0.01, help="share of packets lost, with --openings")
    arguments = arguments.parse_args()
    if arguments.openings:
        return 0 if open_again_and_again(arguments.openings, arguments.scans, arguments.loss) else 1
    kinds = arguments.kinds.split(",")
    with concurrent.futures.ThreadPoolExecutor(len(kinds)) as pool:
        well = list(pool.map(lambda kind: soak(kind, arguments.lives, arguments.seconds), kinds))
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
