#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What the black box costs: times of scans with and without it, in turns, in one run; and a bundle: time and bytes.

Needs SLSD_BIN (the programs) and SLSD_SCENE (bin/make_scene FOLDER) in the environment.
"""
import argparse
import statistics
import time

from service import Service

ROUND_SCANS = 20
WHAT = ("decode_ms", "latency_ms")


def scans(client, count):
    told = [client.call("scan")[0] for _ in range(count)]
    return {what: statistics.median(each[what] for each in told) for what in WHAT}


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--rounds", type=int, default=20)
    options = arguments.parse_args()
    ratios = {what: [] for what in WHAT}
    latencies_ms = []
    with Service(server="[black_box]\nmemory_max_mb = 0") as off, Service() as on:
        with off.client() as without, on.client() as client:
            for service in (off, on):
                service.wait_ready()
            for each in (without, client):
                scans(each, ROUND_SCANS)
            for number in range(options.rounds):
                times = {each: scans(each, ROUND_SCANS) for each in ((client, without) if number % 2 else (without, client))}
                for what in WHAT:
                    ratios[what].append(times[client][what] / times[without][what])
                latencies_ms.append(times[client]["latency_ms"] - times[without]["latency_ms"])
            begin = time.monotonic()
            _, bundle = client.call("bundle")
            took_s = time.monotonic() - begin
            held = client.call("status")[0]["black_box"]
    for what in WHAT:
        error = statistics.stdev(ratios[what]) / len(ratios[what]) ** 0.5
        print(f"{what}: with over without {statistics.median(ratios[what]):.4f} (standard error {error:.4f}, "
              f"{options.rounds} pairs of {ROUND_SCANS} scans)")
    print(f"latency: {statistics.median(latencies_ms):+.2f} ms; held: {held['held_bytes'] / 1e6:.1f} MB; "
          f"a bundle: {len(bundle) / 1e6:.1f} MB in {took_s:.2f} s")


if __name__ == "__main__":
    main()
