#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Measures a stream of dense clouds at a subscriber that takes memfds: clouds a second, latency, processor time and memory.
On a machine that does other things the processor time is steadier than the rate: at most cores / time clouds a second.
Needs SLSD_BIN and SLSD_SCENE, as the tests of the service; --scene is another folder with frame.png, pattern.toml and
calibration.yml. --moving replays frames of a turning object, as tests/corpus/render_turning.py writes them.
"""
import argparse
import mmap
import os
import pathlib
import statistics
import tempfile
import time

from service import SCENE, Service

CONFIGURATION = """
[pattern]
file = "{pattern}"
[[camera]]
name = "camera"
driver = "file"
path = "{frames}"
rate_hz = {rate_hz}
[calibration]
file = "{calibration}"
[decode]
density = "pixels"
dense_stride_px = {stride}
[server]
socket = "slsd.sock"
"""


# The file camera keeps as many frames of 1600x1200. It would decode others each time, which costs no real camera anything.
KEPT = 16


def cpu_s(process):
    with open(f"/proc/{process}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mb(process):
    """@return memory now, and at most so far"""
    with open(f"/proc/{process}/status", encoding="ascii") as file:
        fields = dict(line.split(":", 1) for line in file)
    return tuple(int(fields[name].split()[0]) * 1024 / 1e6 for name in ("VmRSS", "VmHWM"))


def collect(folder, frames):
    """@return a folder with links to frame.png of the first numbered folders, which play forwards, then backwards"""
    found = sorted(frames.glob("*/frame.png"))[:KEPT]
    if len(found) < 2:
        raise SystemExit(f"{frames} has no folders with frame.png: make them by tests/corpus/render_turning.py")
    for i, frame in enumerate(found + found[-2:0:-1]):
        os.symlink(frame.resolve(), folder / f"{i:05}.png")
    return folder, found[0].parent


def measure(configuration, seconds, format):
    with Service(configuration=configuration) as service, service.client() as client:
        service.wait_ready()
        client.call("subscribe", density="pixels", transport="memfd", format=format)
        described, latencies = [], []
        begin = cpu_begin = None
        while begin is None or time.monotonic() - begin < seconds:
            event, memory = client.receive_with_descriptor()
            if event["method"] != "cloud":
                raise SystemExit(f"a scan failed: {event}")
            with memory, mmap.mmap(memory.fileno(), 0, prot=mmap.PROT_READ) as cloud:
                assert len(cloud) == event["params"]["memfd_bytes"]
            latencies.append(time.monotonic_ns() / 1e6 - event["params"]["received_monotonic_us"] / 1e3)
            if begin is None and len(latencies) == 3:  # the first have buffers to make
                begin, cpu_begin, latencies = time.monotonic(), cpu_s(service.process.pid), []
            elif begin is not None:
                described.append(event["params"])
        elapsed, used = time.monotonic() - begin, cpu_s(service.process.pid) - cpu_begin
        return described, latencies, elapsed, used, resident_mb(service.process.pid)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=pathlib.Path, default=SCENE)
    parser.add_argument("--moving", type=pathlib.Path, metavar="FOLDER", help="frames of a moving scene in numbered folders")
    parser.add_argument("--pattern", type=pathlib.Path, help="default: the scene's pattern.toml")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--rate", type=float, default=30, help="frames a second")
    parser.add_argument("--stride", type=int, default=4)
    parser.add_argument("--format", default="ply")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        frames, scene = options.scene / "frame.png", options.scene
        if options.moving:
            frames, scene = collect(pathlib.Path(folder), options.moving)
        configuration = CONFIGURATION.format(frames=frames.resolve(), calibration=(scene / "calibration.yml").resolve(),
                                             rate_hz=options.rate, stride=options.stride,
                                             pattern=(options.pattern or scene / "pattern.toml").resolve())
        described, latencies, seconds, used, (resident, most) = measure(configuration, options.seconds, options.format)
    count, cores = len(described), os.cpu_count()
    median = {key: statistics.median(each[key] for each in described) for key in ("points", "decode_ms", "dense_ms")}
    print(f"{count / seconds:.1f} clouds a second of {median['points']:.0f} points; {1e3 * used / count:.0f} ms of processors "
          f"a cloud, so at most {cores * count / used:.1f} a second on these {cores}; decode {median['decode_ms']:.0f} ms, of "
          f"it pixels {median['dense_ms']:.0f}; from the frame's last byte to the client's hands "
          f"{statistics.median(latencies):.0f} ms; resident {resident:.0f} MB, at most {most:.0f}; "
          f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
