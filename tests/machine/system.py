#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The installed packages on a whole Debian with systemd, a line for each proof: system.py ROOT FOLDER_OF_PACKAGES [--guest
FOLDER] [PART...]. As root. In a container of ROOT, which takes a minute; or in the guest whose disk make_guest.sh wrote to
FOLDER, for the parts that need drivers of a kernel too."""
import argparse
import contextlib
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

SHARED = (installation.nothing_plugged_in, installation.few_rights, installation.who_may_what, installation.calibration,
          installation.killed, installation.frozen, installation.wrong_configuration, bad_state.unknown_groups,
          bad_state.missing_socket_folder, bad_state.bad_state_folder, bad_state.two_versions, bad_state.full_disk)
# These set the service up themselves, which takes 15 s where a processor is emulated.
OF_DEVICES = (cameras.usb_camera, cameras.usb_faults, cameras.usb_unplugged, cameras.hung_camera, cameras.vivid, cameras.gige,
              cameras.gige_of_others, display.projector, display.projector_unplugged, display.projector_late, display.server_killed,
              display.server_hung)
WITH_DRIVERS = (*OF_DEVICES, installation.reboot)
AT_THE_END = (installation.upgrade, installation.at_rest, installation.removed)


def run(machine, parts, chosen):
    """@return how many failed"""
    failed = 0
    for part in parts:
        # The first makes the machine that the others look at.
        if chosen and part.__name__ not in chosen and part is not parts[0]:
            continue
        begin = time.monotonic()
        try:
            machine.look_how_slow()
            if part is not parts[0] and part not in OF_DEVICES:
                machine.set_up()
            print(f"ok      {part.__name__}: {part(machine)} ({time.monotonic() - begin:.0f} s)", flush=True)
        except (AssertionError, TimeoutError, subprocess.SubprocessError) as error:
            failed += 1
            print(f"FAILED  {part.__name__}: {error} ({time.monotonic() - begin:.0f} s, {machine.slow:.0f} times as slow as idle)", flush=True)
    return failed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("packages", type=pathlib.Path)
    parser.add_argument("--guest", type=pathlib.Path)
    parser.add_argument("parts", nargs="*", metavar="PART")
    arguments = parser.parse_intermixed_args()
    parts = (*SHARED, *(WITH_DRIVERS if arguments.guest else ()), *AT_THE_END)
    names = [part.__name__ for part in parts]
    if unknown := set(arguments.parts) - set(names):
        parser.error(f"no such part: {', '.join(sorted(unknown))}; there are: {' '.join(names)}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))  # so that the machine ends, too
    root = arguments.root.resolve()
    lifecycle.lay_out(root, arguments.packages)
    begin = time.monotonic()
    machine = Guest(arguments.guest.resolve(), root / "packages") if arguments.guest else Container(root)
    with contextlib.closing(machine):
        print(f"booted within {time.monotonic() - begin:.0f} s", flush=True)
        failed = run(machine, parts, arguments.parts)
    print(f"{failed} of {len(parts)} parts failed, {time.monotonic() - begin:.0f} s", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
