#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What looking inside costs: decode time with and without somebody who reads the metrics, in turns, in one run.

Needs SLSD_BIN (the programs) and SLSD_SCENE (bin/make_scene FOLDER) in the environment.
"""
import argparse
import statistics
import threading
import time

from service import Service

ROUND_SCANS = 20


def scans(client, count):
    return [client.call("scan")[0]["decode_ms"] for _ in range(count)]


def read_on(service, rate_hz, ends):
    with service.client() as client:
        while not ends.wait(1 / rate_hz):
            client.call("metrics")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--rounds", type=int, default=20)
    arguments.add_argument("--rate-hz", type=float, default=10, help="how often they are read (10)")
    options = arguments.parse_args()
    ratios, looks_ms = [], []
    with Service() as service, service.client() as client:
        service.wait_ready()
        scans(client, ROUND_SCANS)
        for number in range(options.rounds):
            times = {}
            for read in (number % 2 == 0, number % 2 == 1):
                ends = threading.Event()
                reader = threading.Thread(target=read_on, args=(service, options.rate_hz, ends))
                if read:
                    reader.start()
                times[read] = statistics.median(scans(client, ROUND_SCANS))
                ends.set()
                if read:
                    reader.join()
            ratios.append(times[True] / times[False])
        for _ in range(100):
            begin = time.monotonic()
            client.call("metrics")
            looks_ms.append(1000 * (time.monotonic() - begin))
    ratio = statistics.median(ratios)
    spread = statistics.stdev(ratios) / len(ratios) ** 0.5
    print(f"decode time, metrics read {options.rate_hz:g} times a second over not read: {ratio:.4f} "
          f"(standard error {spread:.4f}, {options.rounds} pairs of {ROUND_SCANS} scans); "
          f"a look takes {statistics.median(looks_ms):.2f} ms")


if __name__ == "__main__":
    main()
