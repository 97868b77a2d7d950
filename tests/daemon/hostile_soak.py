#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""One honest client scans, another asks for the status, and many that mean harm come, flood, stall and vanish.

Prints the hostile lines by kind, what the honest clients got, the service's memory and the time that `status` took.
Exit status 1 where a scan was lost or came damaged, a log line was forged or long, or memory grew; with --p99-ms also
where `status` took longer beside floods, with --lines where fewer were sent. For an hour:
hostile_soak.py --seconds 3600 --lines 10000000 --p99-ms 50
--flooded 0.2 --rate-hz 4 leave a machine to others meanwhile.

It needs SLSD_BIN, the folder of slsd, and SLSD_SCENE, what make_scene wrote.
"""
import argparse
import json
import multiprocessing
import re
import sys
import time

from client import RpcError
from hostile_client import ENDLESS, FLOODS, STRIKES, flood, flooding
from point_cloud import vertices
from recovery import resident_kib
from service import Service, wait_until

GROWTH_MAX = 1.10
GROWTH_KIB = 40 << 10  # what clients are being sent at this moment
LOG_LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (debug|info|warning|error|critical) ")


def scan(path, stop, result):
    """Scans until told to stop. What went wrong, and how many went well."""
    from client import Client
    done, wrong, longest = 0, [], 0.0
    with Client(path) as client:
        while not stop.is_set():
            begin = time.monotonic()
            try:
                reply, cloud = client.call("scan", timeout_ms=600000)
                if len(vertices(cloud)) != reply["points"] or reply["points"] < 1000:
                    wrong.append(f"{reply['points']} points")
                done += 1
            except (RpcError, OSError) as error:
                wrong.append(str(error))
                if isinstance(error, OSError):
                    break
            longest = max(longest, time.monotonic() - begin)
    result.put(("scans", done, wrong, longest))


def ask_status(path, pause_s, share, stop, result):
    """The times of those that were asked beside floods."""
    from client import Client
    times, wrong, longest = [], [], 0
    with Client(path) as client:
        while not stop.is_set():
            begin, flooded = time.monotonic(), flooding(share)
            try:
                reply, _ = client.call("status")
                longest = max(longest, len(json.dumps(reply)))
            except (RpcError, OSError) as error:
                wrong.append(str(error))
                break
            if flooded:
                times.append(time.monotonic() - begin)
            time.sleep(pause_s)
    result.put(("status", sorted(times), wrong, longest))


def log_faults(text):
    lines = text.split("\n")[:-1]
    forged = [line for line in lines if not LOG_LINE.match(line)]
    return len(forged), max((len(line.encode()) for line in lines), default=0), forged[:3]


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--lines", type=int, default=0, help="that are not blank, owed at the end")
    parser.add_argument("--clients", type=int, default=64)
    parser.add_argument("--life", type=float, default=2, help="of a hostile client, seconds")
    parser.add_argument("--kinds", default="", help=f"of {', '.join([*FLOODS, *ENDLESS, *STRIKES])}; default: all")
    parser.add_argument("--p99-ms", type=float, default=0)
    parser.add_argument("--flooded", type=float, default=1, metavar="SHARE", help="of each minute, that floods last")
    parser.add_argument("--rate-hz", type=float, default=0, help="of the camera; 0: as fast as frames are asked for")
    parser.add_argument("--no-scans", action="store_true", help="the honest client does not scan")
    return parser.parse_args()


def main():
    arguments = options()
    kinds = arguments.kinds.split(",") if arguments.kinds else [*FLOODS, *ENDLESS, *STRIKES]
    wrong = []
    with (Service(camera=f"rate_hz = {arguments.rate_hz}", server="send_timeout_ms = 2000") as service,
          multiprocessing.Manager() as manager):
        service.wait_ready()
        with service.client() as client:
            for _ in range(10):
                client.call("scan")
        stop = multiprocessing.Event()
        results = multiprocessing.Queue()
        counts = manager.dict()
        total = multiprocessing.Value("q", 0)
        path = str(service.socket)
        processes = [multiprocessing.Process(target=ask_status, args=(path, 0.02, arguments.flooded, stop, results))]
        if not arguments.no_scans:
            processes.append(multiprocessing.Process(target=scan, args=(path, stop, results)))
        hostile = multiprocessing.Process(target=flood, args=(path, kinds, arguments.clients, arguments.life,
                                                              arguments.flooded, stop, counts, total))
        begin = time.monotonic()
        for process in [*processes, hostile]:
            process.start()
        memory = []
        while time.monotonic() < begin + arguments.seconds and service.process.poll() is None:
            time.sleep(min(arguments.seconds / 10, 57))
            memory.append(resident_kib(service.process))
            print(f"{time.monotonic() - begin:7.0f} s {total.value:11} hostile lines {memory[-1]:8} KiB", flush=True)
        stop.set()
        for name, done, faults, longest in [results.get(timeout=120) for _ in processes]:
            wrong += [f"{name}: {fault}" for fault in faults]
            if name == "scans":
                print(f"scans: {done} whole, {len(faults)} wrong, the longest {longest:.2f} s")
            elif done:
                p50, p99 = done[len(done) // 2], done[int(len(done) * 0.99)]
                print(f"status: {len(done)} beside floods, p50 {p50 * 1e3:.1f}, p99 {p99 * 1e3:.1f}, "
                      f"longest {done[-1] * 1e3:.1f} ms; the longest reply {longest} bytes")
                if arguments.p99_ms and p99 * 1e3 > arguments.p99_ms:
                    wrong.append(f"status took {p99 * 1e3:.1f} ms at the 99th percentile")
                if longest > 20_000:
                    wrong.append(f"a status of {longest} bytes")
        for process in [*processes, hostile]:
            process.join()
        print(f"hostile lines that are not blank: {total.value}; all by kind:",
              ", ".join(f"{kind} {count}" for kind, count in sorted(counts.items())))
        if total.value < arguments.lines:
            wrong.append(f"{total.value} hostile lines of {arguments.lines}")
        if service.process.poll() is not None:
            wrong.append(f"the service ended: {service.process.returncode}")
        else:
            with service.client() as client:
                wait_until(lambda: client.call("status")[0]["clients"] == 1, "the hostile clients to be gone")
                client.call("scan", timeout_ms=600000)
                state = client.call("status")[0]
            rest = resident_kib(service.process)
            print(f"after: {state['clients']} client(s), {state['clients_dropped']} dropped, "
                  f"{state['clients_memory']['held_bytes']} bytes held for clients, {rest} KiB")
            if rest > memory[0] * GROWTH_MAX + GROWTH_KIB:
                wrong.append(f"memory grew from {memory[0]} to {rest} KiB")
            if service.stop()[0] != 0:
                wrong.append("the service did not stop well")
        forged, longest, examples = log_faults(service.log.read_text(encoding="utf-8", errors="replace"))
        print(f"log: {forged} forged lines, the longest {longest} bytes")
        if forged or longest > 2048:
            wrong.append(f"log lines: {examples}")
    for fault in wrong[:20]:
        print("WRONG:", fault)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
