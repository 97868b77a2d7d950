#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Simulated scanners, each with its slsd-dds, and a reader of all: how many clouds are lost on the way, and the delay from
the service's socket to the reader.

    SLSD_BIN=build/release/bin tests/clients/dds_load.py --scanners 16 --rate 10 --points 2600
    SLSD_BIN=build/release/bin tests/clients/dds_load.py --scanners 1 --rate 5 --points 500000
"""
import argparse
import contextlib
import datetime
import fcntl
import json
import os
import pathlib
import resource
import signal
import socket
import subprocess
import tempfile
import threading
import time

BIN = pathlib.Path(os.environ["SLSD_BIN"])
FIELDS = "float x,float y,float z,float sigma_mm,uchar intensity,uchar camera".split(",")


def take_domain():
    """A domain that no other test of this machine has, until this process ends. @return it, and what holds it"""
    for domain in range(20, 120):
        try:
            held = open(pathlib.Path(tempfile.gettempdir()) / f"slsd-test-domain-{domain}", "w", encoding="utf-8")
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return domain, held
        except (BlockingIOError, PermissionError):
            continue
    raise RuntimeError("a hundred tests have taken all domains")


class Arrivals:
    """The stamps that a reader prints, by topic."""

    def __init__(self, stream):
        self.at_us, self.changed = {}, threading.Condition()
        threading.Thread(target=self.read, args=(stream,), daemon=True).start()

    def read(self, stream):
        with stream:
            for line in stream:
                topic, stamp, at_ns, _ = line.split()
                whole, fraction = stamp.split(".")
                with self.changed:
                    of_topic = self.at_us.setdefault(topic.split("/")[0], {})
                    of_topic[int(whole) * 1_000_000 + round(int(fraction) / 1000)] = int(at_ns) / 1000
                    self.changed.notify_all()

    def wait(self, condition, seconds=60):
        """@return whether the condition holds, at the latest after these seconds"""
        with self.changed:
            return self.changed.wait_for(lambda: condition(self.at_us), seconds)


class Replay:
    """What slsd is to its subscribers, without the work of scanning: the same cloud again and again."""

    def __init__(self, folder, name, points, rate_hz):
        self.path, self.rate_hz, self.sent, self.stop = folder / f"{name}.sock", rate_hz, [], threading.Event()
        self.confirmed = None  # called with the stamp of each cloud: whether to send another
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {points}", *(f"property {f}" for f in FIELDS)]
        self.cloud = "\n".join([*head, "end_header\n"]).encode() + bytes(18 * points)
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(self.path))
        self.listener.listen()
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            peer, _ = self.listener.accept()
            threading.Thread(target=self.talk, args=(peer,), daemon=True).start()

    def talk(self, peer):
        with contextlib.suppress(OSError), peer, peer.makefile("rb") as lines:  # it hangs up
            for line in lines:
                request = json.loads(line)
                answer = {"status": {"ready": True}}.get(request["method"], {})
                peer.sendall(json.dumps({"jsonrpc": "2.0", "id": request["id"], "result": answer}).encode() + b"\n")
                if request["method"] == "subscribe":
                    self.send_clouds(peer, request["params"].get("transport") == "memfd")

    def send_clouds(self, peer, shared):
        due = time.monotonic()
        while not self.stop.is_set():
            now = time.time_ns() // 1000
            at = datetime.datetime.fromtimestamp(now // 1_000_000, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%S")
            params = {"scan": "replay", "time": f"{at}.{now % 1_000_000:06}Z", "lost": 0, "memfd_bytes" if shared else "bytes": len(self.cloud)}
            message = json.dumps({"jsonrpc": "2.0", "method": "cloud", "params": params}).encode() + b"\n"
            self.sent.append(now)
            if shared:  # as the service does
                memory = os.memfd_create("cloud", os.MFD_ALLOW_SEALING)
                os.write(memory, self.cloud)
                fcntl.fcntl(memory, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE | fcntl.F_SEAL_SEAL)
                socket.send_fds(peer, [message], [memory])
                os.close(memory)
            else:
                peer.sendall(message + self.cloud)
            confirmed = self.confirmed
            if confirmed is not None and not confirmed(now):
                return
            due = max(due + 1 / self.rate_hz, time.monotonic())  # late ones do not follow in a burst
            time.sleep(max(0, due - time.monotonic()))


def measure(scanners=1, points=2600, rate_hz=10.0, seconds=10.0, stalled=False, best_effort=False, rate_max_mb=16.0, clouds=None):
    """@param clouds  of each scanner instead of those in these seconds, each sent when the one before has arrived: however
    slow the machine is, none may be lost
    @return sent, received, lost (of those after the first that arrived), delays_ms sorted, cpu_s"""
    domain, held = take_domain()
    network = ["--domain", str(domain), "--interface", "lo", "--peer", "127.0.0.1", "--rate-max", str(rate_max_mb)]
    names = [f"s{i}" for i in range(scanners)]
    topics = [word for name in names for word in ("--topic", f"{name}/points")]
    read = [BIN / "dds_probe", "--domain", str(domain), *topics, "--stamps", "--count", "1000000000", "--seconds", "600"]
    processes = []

    def start(command, **streams):
        processes.append(subprocess.Popen(command, text=True, **streams))
        return processes[-1]

    with held, tempfile.TemporaryDirectory() as folder:
        services = {name: Replay(pathlib.Path(folder), name, points, rate_hz) for name in names}
        try:
            other = start(read, stdout=subprocess.PIPE) if stalled else None
            arrivals = Arrivals(start(read + (["--best-effort"] if best_effort else []), stdout=subprocess.PIPE).stdout)
            for name in names:
                start([BIN / "slsd-dds", "--name", name, "--socket", services[name].path, *network], stderr=subprocess.DEVNULL)
            for each in [arrivals, *([Arrivals(other.stdout)] if other else [])]:  # nobody counts what comes before
                if not each.wait(lambda at: len(at) == scanners):
                    raise RuntimeError("a reader has no cloud of one of the scanners")
            if other:
                other.send_signal(signal.SIGSTOP)
            begin = time.time_ns() // 1000
            if clouds is None:
                time.sleep(seconds)
            else:
                ends = {name: threading.Event() for name in names}
                for name, service in services.items():
                    service.confirmed = once_arrived(arrivals, name, begin, clouds, ends[name])
                for each in ends.values():
                    each.wait()
            end = time.time_ns() // 1000
            for service in services.values():
                service.stop.set()
            due = {name: [stamp for stamp in service.sent if begin <= stamp < end] for name, service in services.items()}
            arrivals.wait(lambda at: all(at[name].keys() >= set(due[name]) for name in names), 2)
        finally:
            for process in processes:
                process.kill()
                process.wait()
    delays = [(arrivals.at_us[name][stamp] - stamp) / 1000 for name in names for stamp in due[name] if stamp in arrivals.at_us[name]]
    sent, received = sum(map(len, due.values())), len(delays)
    return {"sent": sent, "received": received, "lost": sent - received, "delays_ms": sorted(delays),
            "cpu_s": resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime + resource.getrusage(resource.RUSAGE_CHILDREN).ru_stime}


def once_arrived(arrivals, name, begin, clouds, end):
    """@return the `confirmed` of a Replay: waits until a cloud has arrived, and ends after so many, or if one is lost"""
    stamps = []

    def confirmed(stamp):
        if stamp < begin:
            return True
        stamps.append(stamp)
        if arrivals.wait(lambda at: stamp in at[name]) and len(stamps) < clouds:
            return True
        end.set()
        return False
    return confirmed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scanners", type=int, default=1)
    parser.add_argument("--points", type=int, default=2600)
    parser.add_argument("--rate", type=float, default=10)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--stalled", action="store_true", help="a second reader of all is stopped meanwhile")
    parser.add_argument("--best-effort", action="store_true", help="the reader asks for sensors' QoS")
    parser.add_argument("--rate-max", type=float, default=16, help="megabytes a second, as slsd-dds has it")
    given = parser.parse_args()
    got = measure(given.scanners, given.points, given.rate, given.seconds, given.stalled, given.best_effort, given.rate_max)
    delays = got["delays_ms"] or [float("nan")]
    print(f"{given.scanners} scanners, {given.points} points, {given.rate:g}/s, {given.seconds:g} s"
          f"{', a second reader stalled' if given.stalled else ''}{', best effort' if given.best_effort else ''}: "
          f"{got['sent']} sent, {got['lost']} lost; delay ms: median {delays[len(delays) // 2]:.1f}, "
          f"p99 {delays[min(len(delays) - 1, int(0.99 * len(delays)))]:.1f}, longest {delays[-1]:.1f}; "
          f"processor {got['cpu_s']:.1f} s, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
