#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Runs every block of READERS as it is written, the pages of each reader in an empty Debian, as a user who has sudo:
newcomer.py ROOT SOURCES [--quick] [--from PLACE] [--packages DIR]. As root. ROOT is a Debian with systemd and sudo; SOURCES a clone."""
import argparse
import contextlib
import itertools
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

from blocks import blocks_of, fits, session_of
from machine import Container, require

READERS = (("README.md", "docs/protocol.md"), ("docs/installing.md", "docs/configuration.md"), ("docs/developing.md",))
READER_OF = {page: i for i, pages in enumerate(READERS) for page in pages}
USER, HOME = "newcomer", "/home/newcomer"
TIMEOUT_S = 4 * 3600
# What stands for the devices that the reader writes into the configuration.
STAND_IN = "sed s#/run/slsd/example.sock#/run/slsd/slsd.sock# /etc/slsd/example.toml >/etc/slsd/slsd.toml"
NEEDS_A_PERSON = "slsctl calibrate"  # waits for a board


def lay_out(root, sources, packages):
    home = root / HOME[1:]
    shutil.rmtree(home / "slsd", ignore_errors=True)
    shutil.copytree(sources, home / "slsd", symlinks=True)
    if packages:
        shutil.copytree(packages, home / "slsd/out/package")
    subprocess.run(["chroot", root, "chown", "-R", f"{USER}:", HOME], check=True)
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")


class Newcomer:
    def __init__(self, machine, passed_over):
        self.machine, self.passed_over = machine, passed_over

    def login(self, script, environment=""):
        """What a shell of a new login makes of it. @return its exit status and what it printed"""
        self.machine.write(f"{HOME}/block", script)  # not by its standard input, which its programs may read
        return self.machine.run("su", "-", USER, "-c", f"cd slsd && {environment} bash -e ~/block", check=False, timeout_s=TIMEOUT_S)

    def run_shell(self, text):
        for command in self.passed_over:
            text = re.sub(rf"(?m)^\./run {command}\b.*$", "true", text)
        status, printed = self.login(text)
        require(status == 0, f"status {status}:\n{printed[-3000:]}")

    def run_python(self, text):
        self.machine.write(f"{HOME}/program.py", text)
        self.machine.run("systemctl", "start", "slsd@example.socket")
        status, printed = self.login("python3 ~/program.py", "SLSD_SOCKET=/run/slsd/example.sock")
        require(status == 0, f"status {status}:\n{printed[-3000:]}")

    def run_session(self, text):
        for command, expected in session_of(text):
            if command.startswith(NEEDS_A_PERSON):
                self.write_configuration(text)
                self.machine.run("systemctl", "restart", "slsd")
                _, printed = self.login(f"timeout --signal INT 20 {command}")
                require("board" in printed and "slsd-admin" not in printed, f"{command} prints:\n{printed}")
                self.login("slsctl calibrate cancel")
                continue
            _, printed = self.login(command)
            require(fits(expected, printed), f"{command} prints:\n{printed}instead of:\n" + "\n".join(expected))

    def write_configuration(self, _):
        self.machine.shell(STAND_IN)

    def run(self, block):
        """@return whether it ran as written"""
        begin = time.monotonic()
        ways = {"sh": self.run_shell, "python": self.run_python, "console": self.run_session, "toml": self.write_configuration}
        first = block.text.splitlines()[0]
        try:
            require(block.language in ways, f"nobody knows how to run a block of '{block.language}'")
            ways[block.language](block.text)
        except (AssertionError, TimeoutError) as error:
            print(f"FAILED  {block.place}: {first}\n{error}", flush=True)
            return False
        print(f"ok      {block.place}: {first} ({time.monotonic() - begin:.0f} s)", flush=True)
        return True


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("sources", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="pass over ./run test")
    parser.add_argument("--from", dest="first", metavar="PLACE", help="begin at this block, such as README.md:21")
    parser.add_argument("--packages", type=pathlib.Path, metavar="DIR", help="take these packages and pass over ./run package")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the container ends with it
    blocks = [block for page in READER_OF for block in blocks_of(page, (arguments.sources / page).read_text(encoding="utf-8"))]
    places = [block.place for block in blocks]
    require(arguments.first is None or arguments.first in places, f"no block {arguments.first}; there are: {' '.join(places)}")
    blocks = blocks[places.index(arguments.first):] if arguments.first else blocks
    readers = itertools.groupby(blocks, key=lambda block: READER_OF[block.page])
    failed = sum(run_reader(arguments, list(of_reader)) for _, of_reader in readers)
    print(f"{failed} of {len(blocks)} blocks failed", flush=True)
    return 1 if failed else 0


def run_reader(arguments, blocks):
    """Each reader begins on an empty Debian. @return how many of its blocks failed"""
    empty = arguments.root.resolve()
    root = empty.with_name(empty.name + ".page")
    subprocess.run(["rm", "-rf", root], check=True)
    subprocess.run(["cp", "-a", "--reflink=auto", empty, root], check=True)
    lay_out(root, arguments.sources, arguments.packages)
    passed_over = ["test"] * arguments.quick + ["package"] * bool(arguments.packages)
    failed = 0
    with contextlib.closing(Container(root)) as machine:
        newcomer = Newcomer(machine, passed_over)
        if arguments.packages:
            machine.run("apt-get", "update")  # ./run package would
        before = installed_on(machine)
        for i, block in enumerate(blocks):
            failed += not newcomer.run(block)
            if i == 0:
                print(f"{installed_on(machine) - before} packages for the first block", flush=True)
    return failed


def installed_on(machine):
    return int(machine.shell("dpkg-query -W -f '${db:Status-Status}\\n' | grep -c ^installed")[1])


if __name__ == "__main__":
    sys.exit(main())
