#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What the Python package costs beyond the scan: a service that is simulated lends a cloud of a million points.

    python3 tests/clients/python_cost.py [POINTS]
"""
import array
import fcntl
import json
import os
import pathlib
import socket
import sys
import tempfile
import threading
import time
import tracemalloc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients/python"))

import numpy as np  # noqa: E402

import slsd  # noqa: E402

FIELDS = "float x,float y,float z,float sigma_mm,uchar intensity,uchar camera".split(",")
SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE | fcntl.F_SEAL_SEAL


def lend(peer, descriptor, size, answered):
    with peer, peer.makefile("rb") as lines:
        for line in lines:
            result = {"jsonrpc": "2.0", "id": json.loads(line)["id"], "result": {"memfd_bytes": size, "points": 1}}
            answered.append(time.perf_counter())
            peer.sendmsg([json.dumps(result).encode() + b"\n"],
                         [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [descriptor]))])


def measure(points=1_000_000, scans=50):
    """@return seconds from the moment the service answers to the array, one for each scan; bytes that were allocated for it;
    whether the array owns memory"""
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {points}", *(f"property {field}" for field in FIELDS)]
    data = "\n".join([*head, "end_header\n"]).encode() + bytes(18 * points)
    descriptor = os.memfd_create("cloud", os.MFD_ALLOW_SEALING)
    os.write(descriptor, data)
    fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, SEALS)
    answered = []
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
        listener.bind(f"{folder}/slsd.sock")
        listener.listen()
        threading.Thread(target=lambda: lend(listener.accept()[0], descriptor, len(data), answered), daemon=True).start()
        with slsd.Scanner(f"{folder}/slsd.sock") as scanner:
            times = []
            for _ in range(scans):
                got = scanner.scan().points
                times.append(time.perf_counter() - answered[-1])
            tracemalloc.start()
            got = scanner.scan().points
            allocated = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
    os.close(descriptor)
    assert len(got) == points and not np.any(got["z"])
    return sorted(times), allocated, bool(got.flags.owndata)


def main():
    points = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    times, allocated, owns = measure(points)
    print(f"{points} points over a memfd: {1000 * times[len(times) // 2]:.2f} ms beyond the scan (median of {len(times)}, longest "
          f"{1000 * times[-1]:.2f}); {1 if owns else 0} copies, {allocated} bytes allocated at most; load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
