#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The installed packages on a whole Debian with systemd, a line for each proof: system.py ROOT FOLDER_OF_PACKAGES [--guest
FOLDER] [PART...]. As root. In a container of ROOT, which takes a minute; or in the guest whose disk make_guest.sh wrote to
FOLDER, for the parts that need drivers of a kernel too."""
import argparse
import concurrent.futures
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import time

import bad_state
import cameras
import display
import installation
import lifecycle
from guest import Guest
from machine import Container

# What makes the machine that the others look at, and what unmakes it.
FIRST, LAST = installation.nothing_plugged_in, installation.removed
# The longest first, so that two guests end together.
SHARED = (installation.upgrade, bad_state.full_disk, bad_state.two_versions, bad_state.bad_state_folder, bad_state.unknown_groups,
          installation.wrong_configuration, installation.frozen, bad_state.missing_socket_folder, installation.killed,
          installation.calibration, installation.few_rights, installation.who_may_what, installation.at_rest)
# These set the service up themselves, which takes 15 s where a processor is emulated.
OF_DEVICES = (cameras.usb_unplugged, display.projector_unplugged, display.server_hung, display.server_killed, display.projector_late,
              cameras.usb_camera, display.projector, cameras.usb_faults, cameras.gige, cameras.vivid, cameras.hung_camera,
              cameras.gige_of_others)
WITH_DRIVERS = (installation.reboot, *OF_DEVICES)


def prove(machine, part):
    """@return whether it holds"""
    begin = time.monotonic()
    try:
        machine.look_how_slow()
        if part is not FIRST and part not in OF_DEVICES:
            machine.set_up()
        print(f"ok      {part.__name__}: {part(machine)} ({time.monotonic() - begin:.0f} s)", flush=True)
    except (AssertionError, TimeoutError, subprocess.SubprocessError) as error:
        print(f"FAILED  {part.__name__}: {error} ({time.monotonic() - begin:.0f} s, {machine.slow:.0f} times as slow as idle)", flush=True)
        return False
    return True


def work(make, machines, parts, last):
    """Proves what is left of the parts on a machine of its own. @return how many failed"""
    begin = time.monotonic()
    machine = machines.enter_context(contextlib.closing(make()))
    print(f"booted within {time.monotonic() - begin:.0f} s", flush=True)
    failed = not prove(machine, FIRST)
    failed += sum(not prove(machine, part) for part in parts)
    return failed + sum(not prove(machine, part) for part in last)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("packages", type=pathlib.Path)
    parser.add_argument("--guest", type=pathlib.Path)
    parser.add_argument("parts", nargs="*", metavar="PART")
    arguments = parser.parse_intermixed_args()
    parts = (FIRST, *(WITH_DRIVERS if arguments.guest else ()), *SHARED, LAST)
    names = [part.__name__ for part in parts]
    if unknown := set(arguments.parts) - set(names):
        parser.error(f"no such part: {', '.join(sorted(unknown))}; there are: {' '.join(names)}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))  # so that the machine ends, too
    root = arguments.root.resolve()
    lifecycle.lay_out(root, arguments.packages)
    begin = time.monotonic()
    chosen = [part for part in parts[1:-1] if part.__name__ in arguments.parts or not arguments.parts]
    last = [LAST] if not arguments.parts or LAST.__name__ in arguments.parts else []
    left = iter(chosen)  # of which each machine takes the next
    if arguments.guest:
        def make():
            return Guest(arguments.guest.resolve(), root / "packages")
        count = min(2, len(os.sched_getaffinity(0)), max(1, len(chosen) // 4))  # each emulates on a core of its own
    else:
        def make():
            return Container(root)
        count = 1
    with contextlib.ExitStack() as machines, concurrent.futures.ThreadPoolExecutor(count) as threads:
        workers = [threads.submit(work, make, machines, left, last if number == 0 else ()) for number in range(count)]
        try:
            failed = sum(worker.result() for worker in workers)
        except BaseException:
            machines.close()  # what a thread waits for ends with them
            raise
    print(f"{failed} of {count + len(chosen) + len(last)} proofs failed, {time.monotonic() - begin:.0f} s", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
