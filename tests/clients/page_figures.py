#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The figures of the page, in headless Chromium with software GL: the first picture after opening, frames a second of a
dense cloud that is turned, dense clouds a second live, what watchers cost another subscriber and the decoder, and the
memory of slsd-web. Needs SLSD_BIN and SLSD_SCENE (a folder of bin/make_scene, or of rendered frames) in the environment.
"""
import argparse
import os
import pathlib
import statistics
import sys
import threading
import time

from browser import Browser
from page_service import Web
from service import Service

TURN = """
const done = arguments[arguments.length - 1], begin = performance.now(), before = view.drawn;
const turn = (now) => {
  view.points.rotation.y += 0.02;
  view.draw();
  now - begin < 5000 ? requestAnimationFrame(turn) : done([view.drawn - before, (now - begin) / 1000]);
};
requestAnimationFrame(turn);"""


def resident_mib(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def processor_s(pid):
    """Of a process and all that it started."""
    parents, times = {}, {}
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        parents[int(folder.name)] = int(fields[1])
        times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def is_of(each):
        while each not in (0, pid):
            each = parents.get(each, 0)
        return each == pid
    return sum(seconds for each, seconds in times.items() if is_of(each))


def browse(options):
    with Service() as service, Web(service) as web, Browser() as browser:
        service.wait_ready()
        browser.resize(1600, 1100)
        browser.open("about:blank")
        times = []
        for _ in range(5):
            begin = time.monotonic()
            browser.open(web.address)
            browser.wait("document.getElementById('picture').dataset.frames", "no picture")
            times.append(time.monotonic() - begin)
        print(f"first picture after opening: {statistics.median(times):.2f} s (of 5; longest {max(times):.2f} s)")
        browser.wait("!document.getElementById('scan').disabled", "nothing to draw clouds with")
        browser.run("const density = document.getElementById('density');"
                    "density.value = 'pixels'; density.dispatchEvent(new Event('change'));"
                    "document.getElementById('scan').click();")
        browser.wait("view.ply && view.ply.count > 10000", "no dense cloud")
        # As many points as the figure names, whatever the scene: the cloud again and again, or its beginning.
        browser.run("""
            const wanted = arguments[0], ply = view.ply, records = new Uint8Array(wanted * ply.record);
            const from = new Uint8Array(ply.buffer, ply.begin, ply.count * ply.record);
            for (let at = 0; at < records.length; at += from.length)
              records.set(from.subarray(0, Math.min(from.length, records.length - at)), at);
            const header = new TextDecoder('latin1').decode(new Uint8Array(ply.buffer, 0, ply.begin))
              .replace(/element vertex \\d+/, 'element vertex ' + wanted);
            const head = new TextEncoder().encode(header), whole = new Uint8Array(head.length + records.length);
            whole.set(head);
            whole.set(records, head.length);
            view.show(readCloud(whole.buffer));""", options.points)
        used_s = processor_s(browser.driver.pid)
        browser.run("view.draw();")
        drawn, seconds = browser.ask("POST", browser.session + "/execute/async", {"script": TURN, "args": []})
        used_s = processor_s(browser.driver.pid) - used_s
        print(f"frames a second of {options.points} points, turned: {drawn / seconds:.1f}; each takes {1000 * used_s / drawn:.0f} "
              f"ms of all the browser's processes, of {os.cpu_count()} processors; {browser.run('return view.part;'):.2f} of the "
              "points are drawn while it turns")
        browser.run("document.getElementById('cloud-live').click(); window.clouds = 0;"
                    "const show = view.show.bind(view); view.show = (b) => { ++window.clouds; show(b); };")
        for shown, what in (("space", "clouds"), ("z", "maps of depth"), ("clipping", "maps of clipping")):
            browser.run("const shown = document.getElementById('shown-as'); shown.value = arguments[0];"
                        "shown.dispatchEvent(new Event('change')); window.clouds = 0;", shown)
            browser.wait("window.clouds > 2", "no live clouds")
            before, begin = browser.run("return window.clouds;"), time.monotonic()
            time.sleep(options.seconds)
            live = (browser.run("return window.clouds;") - before) / (time.monotonic() - begin)
            points = browser.run("return view.ply.count;")
            print(f"live dense {what} of {points} points a second: {live:.1f}; slsd-web has {resident_mib(web.process.pid):.0f} MiB")


def watch(web, ends, density):
    after = 0
    while not ends.is_set():
        status, headers, _ = web.get(f"/api/cloud?density={density}&after={after}")
        if status == 200:
            after = int(headers["X-Slsd-About"].split('"number":')[1].split(",")[0].rstrip("}"))


def cost(options):
    """Another subscriber, who takes ten clouds a second, with and without watchers, in turns."""
    lost, decode_ms = {True: 0, False: 0}, {True: [], False: []}
    with Service() as service, Web(service) as web, service.client() as client:
        service.wait_ready()
        client.call("subscribe", rate_hz=10)
        for turn in range(2 * options.turns):
            watched, ends = turn % 2 == 1, threading.Event()
            watchers = [threading.Thread(target=watch, args=(web, ends, "symbols")) for _ in range(options.watchers)]
            for watcher in watchers if watched else []:
                watcher.start()
            end = time.monotonic() + options.seconds
            while time.monotonic() < end:
                params = client.receive()[0]["params"]
                lost[watched] += params["lost"]
                decode_ms[watched].append(params["decode_ms"])
            ends.set()
            for watcher in watchers if watched else []:
                watcher.join()
        memory = resident_mib(web.process.pid)
    ratio = statistics.median(decode_ms[True]) / statistics.median(decode_ms[False])
    print(f"{options.watchers} watchers: another subscriber lost {lost[True]} clouds ({lost[False]} without); decode time "
          f"{ratio:.3f} of that without ({len(decode_ms[True])} and {len(decode_ms[False])} scans); slsd-web has {memory:.0f} MiB")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--points", type=int, default=500_000)
    arguments.add_argument("--watchers", type=int, default=1)
    arguments.add_argument("--seconds", type=float, default=5)
    arguments.add_argument("--turns", type=int, default=6)
    arguments.add_argument("--only", choices=("browse", "cost"))
    options = arguments.parse_args()
    if options.only != "cost":
        browse(options)
    if options.only != "browse":
        cost(options)


if __name__ == "__main__":
    sys.exit(main())
