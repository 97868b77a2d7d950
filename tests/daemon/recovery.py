# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""How a service comes back after a fault, and what it costs it."""
import collections
import contextlib
import os
import pathlib
import threading
import time

from client import RpcError

TIMEOUT_S = 60
# What a scan may say that lost its frame or its camera. Which of them depends on where the fault met it.
LOST = {"disconnected", "timeout", "frame_dropped", "frame_late", "frame_stale", "frame_torn"}


def scan_until_it_works(client):
    """The seconds that it took, the error of each scan before, and the result."""
    begin = time.monotonic()
    errors = []
    while True:
        try:
            result, _ = client.call("scan")
            return time.monotonic() - begin, errors, result
        except RpcError as error:
            errors.append(error.name)
            last = str(error)
        if time.monotonic() - begin > TIMEOUT_S:
            raise TimeoutError(f"no scan works: {collections.Counter(errors)}, the last: {last}")


def scan_until_it_fails(client, name=None, **params):
    """The error of the first scan that fails; with a name, of the first that fails with it."""
    end = time.monotonic() + TIMEOUT_S
    others = collections.Counter()
    while time.monotonic() < end:
        try:
            client.call("scan", **params)  # a frame from before the fault may come first
        except RpcError as error:
            if name in (None, error.name):
                return error
            assert error.name in LOST, str(error)
            others[error.name] += 1
    raise TimeoutError(f"no scan fails as it should, with {name or 'any error'}; others: {others}")


@contextlib.contextmanager
def soon(seconds, strike, *arguments):
    """Strikes while the block is at work, and not after its end."""
    hand = threading.Timer(seconds, strike, arguments)
    hand.start()
    try:
        yield hand
    finally:
        hand.join()


def openings(client):
    """How often the first camera was opened."""
    return client.call("status")[0]["cameras"][0]["opened"]


def scan_until_opened_again(client, opened, **params):
    """Whatever comes of the scans: one may fail, another may wait for the camera."""
    while openings(client) == opened:
        try:
            client.call("scan", **params)
        except RpcError as error:
            assert error.name in LOST, str(error)


def resident_kib(process):
    with open(f"/proc/{process.pid}/smaps_rollup", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("Rss:"))


def processor_seconds(process):
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as stat:
        user, system = stat.read().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def descriptors(process):
    return len(list(pathlib.Path(f"/proc/{process.pid}/fd").iterdir()))


def threads(process):
    return len(list(pathlib.Path(f"/proc/{process.pid}/task").iterdir()))
