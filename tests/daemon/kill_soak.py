#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Kills slsd with SIGKILL at random moments (starting, scanning, loading anew, sending) and starts it again.

Each time it is to be ready again and to scan, with nothing left behind. Prints the times until it answered and until
its devices were ready. Exit status 1 otherwise. For the figure: kill_soak.py --kills 200

It needs SLSD_BIN, the folder of slsd, and SLSD_SCENE, what make_scene wrote.
"""
import argparse
import collections
import contextlib
import random
import sys
import threading
import time

from client import RpcError
from service import Service, wait_until

EXPECTED = {"slsd.toml", "slsd.sock", "log"}


def work(service, what, stop):
    """Keeps the service at work of a kind until it dies."""
    requests = {"scanning": ("scan", {}), "loading anew": ("reload", {}),
                "sending": ("scan", {"frames": "raw", "texture": False})}
    with contextlib.suppress(OSError, RpcError, ValueError), service.client(timeout=5) as client:
        if what == "subscribed":
            client.call("subscribe")
        while not stop.is_set():
            if what == "subscribed":
                client.receive()
            else:
                method, params = requests[what]
                client.call(method, **params)


def kill_once(service, chooser, moments):
    what = chooser.choice(["starting", "scanning", "loading anew", "sending", "subscribed"])
    moments[what] += 1
    service.launch()
    if what != "starting":
        wait_until(lambda: answers(service), "an answer")
        stop = threading.Event()
        worker = threading.Thread(target=work, args=(service, what, stop))
        worker.start()
    time.sleep(chooser.random() * (0.6 if what == "starting" else 0.4))
    service.process.kill()
    service.process.wait()
    if what != "starting":
        stop.set()
        worker.join()


def answers(service):
    try:
        with service.client() as client:
            return bool(client.call("status"))
    except OSError:
        return False


def start_again(service):
    """The seconds until it answers, and until its devices are ready."""
    begin = time.monotonic()
    service.launch()
    wait_until(lambda: service.process.poll() is not None or answers(service), "an answer")
    answered = time.monotonic() - begin
    service.wait_ready()
    ready = time.monotonic() - begin
    with service.client() as client:
        if client.call("scan", timeout_ms=600000)[0]["points"] < 1000:
            raise ValueError("the first scan is no good")
    left = {entry.name for entry in service.folder.iterdir()} - EXPECTED
    if left:
        raise ValueError(f"left behind: {left}")
    return answered, ready


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    chooser = random.Random(arguments.seed)
    service = Service()
    moments = collections.Counter()
    times = []
    for number in range(1, arguments.kills + 1):
        kill_once(service, chooser, moments)
        try:
            times.append(start_again(service))
        except (OSError, RpcError, ValueError, TimeoutError) as error:
            print(f"WRONG: after kill {number}: {error}\n{service.log_text()[-2000:]}")
            return 1
        finally:
            service.process.kill()
            service.process.wait()
        if number % 20 == 0:
            print(f"{number} kills", flush=True)
    print(f"{arguments.kills} times killed ({', '.join(f'{count} {what}' for what, count in sorted(moments.items()))}), "
          f"{len(times)} times ready again")
    for index, what in enumerate(["answers", "ready"]):
        ordered = sorted(each[index] for each in times)
        print(f"until it {what}: median {ordered[len(ordered) // 2]:.2f} s, longest {ordered[-1]:.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
