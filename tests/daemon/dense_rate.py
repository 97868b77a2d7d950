#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Clouds of pixels a second of a scene that stands still, at a subscriber that takes memfds, and what each costs of the
processors. On a machine that does other things the processor's time tells more than the rate: a cloud that takes t of
it comes at cores / t at most. Needs SLSD_BIN and SLSD_SCENE, as the tests of the service; --scene is another folder
with frame.png, pattern.toml and calibration.yml.
"""
import argparse
import mmap
import os
import pathlib
import statistics
import time

from service import SCENE, Service

CONFIGURATION = """
[pattern]
file = "{pattern}"
[[camera]]
name = "camera"
driver = "file"
path = "{scene}/frame.png"
rate_hz = 30
[calibration]
file = "{scene}/calibration.yml"
[decode]
density = "pixels"
dense_stride_px = {stride}
[server]
socket = "slsd.sock"
"""


def cpu_s(process):
    with open(f"/proc/{process}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", type=pathlib.Path, default=SCENE)
    parser.add_argument("--pattern", type=pathlib.Path, help="default: the scene's pattern.toml")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--stride", type=int, default=4)
    parser.add_argument("--format", default="ply")
    options = parser.parse_args()
    configuration = CONFIGURATION.format(scene=options.scene.resolve(), stride=options.stride,
                                         pattern=(options.pattern or options.scene / "pattern.toml").resolve())
    with Service(configuration=configuration) as service, service.client() as client:
        service.wait_ready()
        client.call("subscribe", density="pixels", transport="memfd", format=options.format)
        described, latencies = [], []
        begin = cpu_begin = None
        while begin is None or time.monotonic() - begin < options.seconds:
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
        seconds, used = time.monotonic() - begin, cpu_s(service.process.pid) - cpu_begin
        with service.client() as other:
            resident = other.call("status")[0].get("resident_bytes", 0) / 1e6
    count = len(described)
    print(f"{count / seconds:.1f} clouds a second of {described[-1]['points']} points; {1e3 * used / count:.0f} ms of "
          f"processors a cloud, so at most {os.cpu_count() * count / used:.1f} a second on these {os.cpu_count()}; decode "
          f"{statistics.median(each['decode_ms'] for each in described):.0f} ms, of it pixels "
          f"{statistics.median(each['dense_ms'] for each in described):.0f}; into the client's hands "
          f"{statistics.median(latencies):.0f} ms; resident {resident:.0f} MB; load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
