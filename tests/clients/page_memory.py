#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The memory of slsd-web while ten watch: seven clouds of symbols, three those of pixels, two of them the picture too. Says
every ten seconds what it has, and in the end whether that was level. Needs SLSD_BIN and SLSD_SCENE in the environment."""
import argparse
import sys
import threading
import time

from page_figures import resident_mib, watch
from page_service import Web
from service import Service


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--seconds", type=float, default=3600)
    arguments.add_argument("--limit-mib", type=float, default=64)
    options = arguments.parse_args()
    with Service() as service, Web(service) as web:
        service.wait_ready()
        ends, seen = threading.Event(), []

        def pictures():
            while not ends.wait(0.3):
                web.get("/api/frame?as_shown=1&format=raw")
        watchers = [threading.Thread(target=watch, args=(web, ends, "symbols" if i < 7 else "pixels")) for i in range(10)]
        watchers += [threading.Thread(target=pictures) for _ in range(2)]
        for watcher in watchers:
            watcher.start()
        end = time.monotonic() + options.seconds
        while time.monotonic() < end:
            time.sleep(min(10, options.seconds / 6))
            seen.append(resident_mib(web.process.pid))
            print(f"{options.seconds - end + time.monotonic():.0f} s: {seen[-1]:.1f} MiB", flush=True)
        ends.set()
        for watcher in watchers:
            watcher.join()
    first, last = seen[: len(seen) // 2], seen[len(seen) // 2:]
    print(f"largest of the first half {max(first):.1f} MiB, of the second {max(last):.1f} MiB (limit {options.limit_mib:g})")
    return 0 if max(seen) <= options.limit_mib and max(last) <= 1.1 * max(first) + 2 else 1


if __name__ == "__main__":
    sys.exit(main())
