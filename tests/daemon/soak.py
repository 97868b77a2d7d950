#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans many times over the socket of a running slsd and reports its memory, at rest and as the scans go by.

Exit status 1 where the memory after the last scan is more than 5 % above that after the first ten, by which the
service's buffers have grown to the size of its frames.
"""
import argparse
import json
import socket
import sys
import time

WARM_UP_SCANS = 10
GROWTH_MAX = 1.05


def resident_kib(pid):
    with open(f"/proc/{pid}/smaps_rollup", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("Rss:"))


class Client:
    def __init__(self, path):
        connection = socket.socket(socket.AF_UNIX)
        connection.settimeout(60)
        connection.connect(path)
        self.stream = connection.makefile("rwb")

    def call(self, number, method, params):
        request = {"jsonrpc": "2.0", "id": number, "method": method, "params": params}
        self.stream.write(json.dumps(request).encode() + b"\n")
        self.stream.flush()
        reply = json.loads(self.stream.readline())
        if "error" in reply:
            sys.exit(f"soak: {method} {number}: {reply['error']['message']}")
        return reply["result"]

    def wait_ready(self):
        """Until the projector and the cameras are open."""
        while not self.call(0, "status", {})["ready"]:
            time.sleep(0.1)

    def scan(self, number):
        """One scan; the number of its points."""
        result = self.call(number, "scan", {"format": "ply"})
        if len(self.stream.read(result["bytes"])) != result["bytes"]:
            sys.exit(f"soak: scan {number}: the cloud is cut short")
        return result["points"]


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("socket")
    arguments.add_argument("pid", type=int)
    arguments.add_argument("--scans", type=int, default=10000)
    arguments = arguments.parse_args()

    client = Client(arguments.socket)
    client.wait_ready()
    at_rest = resident_kib(arguments.pid)
    print(f"{'at rest':>20}: {at_rest:8} KiB", flush=True)
    warm = at_rest
    report_each = max(1, arguments.scans // 10)
    for number in range(1, arguments.scans + 1):
        points = client.scan(number)
        if number == WARM_UP_SCANS:
            warm = resident_kib(arguments.pid)
        if number in (1, WARM_UP_SCANS, arguments.scans) or number % report_each == 0:
            print(f"{f'after {number} scans':>20}: {resident_kib(arguments.pid):8} KiB, {points} points", flush=True)

    last = resident_kib(arguments.pid)
    print(f"after the last over at rest: {last / at_rest:.3f}; over after {WARM_UP_SCANS}: {last / warm:.3f}")
    return 0 if last <= GROWTH_MAX * warm else 1


sys.exit(main())
