#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Measures what a start of slsd costs: computing from exec to READY=1, and the first cloud after it, asked
for at once (its devices open meanwhile).

usage: SLSD_BIN=build/release/bin SLSD_SCENE=FOLDER start_cost.py [--starts 11] [--ready-max S] [--cloud-max S]

FOLDER is as `make_scene FOLDER` writes it. CPU time hardly depends on what else the machine does, though caches shared
with others cost up to twice; the wall clock does. With limits given, the exit status is 1 where a median is above one.
"""
import argparse
import os
import socket
import statistics
import sys
import tempfile
import time

from service import TIMEOUT_S, Service


def cpu_seconds(pid):
    """Of all threads of a process, those that ended too: clock_getcpuclockid(3), to the nanosecond."""
    return time.clock_gettime((~pid << 3) | 2)


def wait_for_ready(notifications):
    while b"READY=1" not in notifications.recv(4096).split(b"\n"):
        pass


def start_once(scans):
    """Computing until READY=1, and of each scan the computing of the service and the client's wait, in seconds."""
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notifications:
        path = os.path.join(folder, "notify")
        notifications.bind(path)
        notifications.settimeout(TIMEOUT_S)
        service = Service(environment={"NOTIFY_SOCKET": path})
        service.launch()
        try:
            wait_for_ready(notifications)
            ready = cpu_seconds(service.process.pid)
            clouds = []
            with service.client() as client:
                for _ in range(scans):
                    before, asked = cpu_seconds(service.process.pid), time.monotonic()
                    client.call("scan", format="ply")
                    waited = time.monotonic() - asked
                    clouds.append((cpu_seconds(service.process.pid) - before, waited))
            return ready, clouds
        finally:
            service.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=11)
    parser.add_argument("--ready-max", type=float, metavar="S", help="most CPU time until READY=1")
    parser.add_argument("--cloud-max", type=float, metavar="S", help="most CPU time of the first cloud")
    arguments = parser.parse_args()
    start_once(1)  # files come into the page cache
    starts = [start_once(4) for _ in range(arguments.starts)]
    ready = statistics.median(ready for ready, _ in starts)
    first = [statistics.median(clouds[0][which] for _, clouds in starts) for which in (0, 1)]
    later = [statistics.median(cloud[which] for _, clouds in starts for cloud in clouds[1:]) for which in (0, 1)]
    print(f"CPU from start to READY: {1e3 * ready:.0f} ms (least {1e3 * min(r for r, _ in starts):.0f})")
    print(f"first cloud: {1e3 * first[0]:.0f} ms of CPU, after {1e3 * first[1]:.0f} ms")
    print(f"later clouds: {1e3 * later[0]:.0f} ms of CPU, after {1e3 * later[1]:.0f} ms")
    above = [limit is not None and value > limit
             for value, limit in ((ready, arguments.ready_max), (first[0], arguments.cloud_max))]
    sys.exit(1 if any(above) else 0)


if __name__ == "__main__":
    main()
