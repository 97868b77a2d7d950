#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Installs, upgrades, downgrades, kills, removes and purges the packages in random order in a root folder, and compares the
file system after each; then lives with instances of the units in a container: lifecycle.py ROOT FOLDER_OF_PACKAGES [--rounds N]
[--seed N]. As root; ROOT is a Debian with what the packages depend on, and with none of them."""
import argparse
import contextlib
import hashlib
import os
import pathlib
import random
import re
import shutil
import signal
import stat
import subprocess
import sys
import time

import instances
from machine import Container

NAMES = ("slsd", "slsd-client", "slsd-calibrate", "slsd-display", "slsd-web", "slsd-tcp", "slsd-dds", "slsd-model", "libslsd-dev", "python3-slsd")
# What dpkg, the loader and the tools of users keep for themselves, whatever is installed.
KEPT_BY_OTHERS = ("proc", "sys", "dev", "tmp", "packages", "var/lib/dpkg", "var/log", "var/cache", "etc/ld.so.cache", "etc/passwd-", "etc/group-",
                  "etc/shadow-", "etc/gshadow-", "etc/.pwd.lock", "etc/subuid-", "etc/subgid-", "var/lib/systemd/catalog", "run/lock", "usr/share/mime",
                  "var/lib/systemd/deb-systemd-helper-masked", "usr/share/man/index.db",
                  # with the number of a groupadd or useradd that was killed while it held the lock
                  "etc/passwd.", "etc/group.", "etc/shadow.", "etc/gshadow.")
CALIBRATION, CONFIGURATION = "var/lib/slsd/calibration.yml", "etc/slsd/slsd.toml"
MINE = "# the administrator's own line\n"


def content_of(path, status, sums):
    """Its sum, read again only where the kernel has seen a change since: dpkg sets times of modification as it likes, and
    nobody sets those of change."""
    key = (status.st_dev, status.st_ino, status.st_ctime_ns, status.st_size)
    if key not in sums:
        sums[key] = hashlib.sha256(path.read_bytes()).hexdigest()
    return sums[key]


def look(root, sums):
    """Each file by its path: kind, owner, rights and content. Times are nobody's business."""
    seen = {}
    for folder, folders, files in os.walk(root):
        inside = os.path.relpath(folder, root)
        for name in folders + files:
            path = os.path.normpath(os.path.join(inside, name))
            if path.startswith(KEPT_BY_OTHERS):
                continue
            status = os.lstat(root / path)
            content = ""
            if stat.S_ISLNK(status.st_mode):
                content = os.readlink(root / path)
            elif stat.S_ISREG(status.st_mode):
                content = content_of(root / path, status, sums)
            seen[path] = (status.st_mode, status.st_uid, status.st_gid, content)
        folders[:] = [name for name in folders if not os.path.normpath(os.path.join(inside, name)).startswith(KEPT_BY_OTHERS)]
    return seen


def differences(before, after):
    lines = [f"gone: {path}" for path in before.keys() - after.keys()] + [f"left: {path}" for path in after.keys() - before.keys()]
    return lines + [f"changed: {path}" for path in before.keys() & after.keys() if before[path] != after[path]]


def make_next_version(packages, folder):
    """The same packages with a higher version and another configuration, as a release would have it."""
    for package in packages.glob("*.deb"):
        if "dbgsym" in package.name:
            continue
        tree = folder / "tree"
        subprocess.run(["dpkg-deb", "-R", package, tree], check=True)
        control = tree / "DEBIAN/control"
        text = control.read_text(encoding="utf-8")
        version = re.search(r"^Version: (.*)$", text, re.MULTILINE)[1]
        text = text.replace(f"Version: {version}\n", f"Version: {version}+next\n")
        text = re.sub(rf"\((=|<<|>=) {re.escape(version)}\)", rf"(\1 {version}+next)", text)
        control.write_text(text, encoding="utf-8")
        if (tree / CONFIGURATION).exists():
            with open(tree / CONFIGURATION, "a", encoding="utf-8") as file:
                file.write("# A line of the next version.\n")
        subprocess.run(["dpkg-deb", "--root-owner-group", "-Znone", "-b", tree, folder / package.name], check=True,
                       stdout=subprocess.DEVNULL)
        shutil.rmtree(tree)


def lay_out(root, packages):
    """Both versions, as /packages."""
    shutil.rmtree(root / "packages", ignore_errors=True)
    for version in ("this", "next"):
        (root / "packages" / version).mkdir(parents=True)
    for package in packages.glob("*.deb"):
        if "dbgsym" not in package.name:
            shutil.copy(package, root / "packages/this")
    make_next_version(packages, root / "packages/next")


class Machine:
    def __init__(self, root, packages):
        self.root, self.random = root, random.Random()
        lay_out(root, packages)
        self.names = [name for name in NAMES if list(packages.glob(f"{name}_*.deb"))]
        self.sums = {}
        self.repair()  # a run that was stopped leaves what it had installed
        self.dpkg("--purge", *reversed(NAMES))
        self.configure_others()
        self.clean = look(root, self.sums)

    def run(self, *arguments, kill_after_s=None):
        """@return whether it came to its end, and what it wrote"""
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
        process = subprocess.Popen(["chroot", self.root, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   env=environment, start_new_session=True, stdin=subprocess.DEVNULL)
        try:
            output, _ = process.communicate(timeout=kill_after_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
            return False, output
        if process.returncode != 0 and kill_after_s is None:
            raise AssertionError(f"{' '.join(arguments)}: status {process.returncode}\n{output}")
        return process.returncode == 0, output

    def dpkg(self, *arguments, kill_after_s=None):
        return self.run("dpkg", "--force-unsafe-io", "--force-confold", "--force-downgrade", *arguments, kill_after_s=kill_after_s)

    def repair(self):
        """As one does after the power failed in the middle; what was not yet unpacked the next installation brings."""
        with contextlib.suppress(AssertionError):
            self.dpkg("--configure", "-a")

    def configure_others(self):
        """Whoever is killed while it handles a trigger of ours configures itself anew: what that makes is no matter of ours."""
        for triggers in sorted((self.root / "var/lib/dpkg/info").glob("*.triggers")):
            if re.search("^interest", triggers.read_text(encoding="utf-8"), re.MULTILINE):
                self.run("dpkg-reconfigure", triggers.stem)

    def files_of(self, version):
        return sorted(f"/packages/{version}/{file.name}" for file in (self.root / "packages" / version).iterdir())

    def is_there(self, path):
        return (self.root / path).exists()

    def text(self, path):
        return (self.root / path).read_text(encoding="utf-8")


def check_installed(machine):
    _, output = machine.dpkg("--verify", *machine.names)  # each file's sum against that of the package
    changed = [line for line in output.splitlines() if " c /" not in line]
    assert not changed, output
    machine.run("slsd", "--check-config")
    machine.run("slsctl", "--version")
    owner = (machine.root / "var/lib/slsd").stat().st_uid if machine.is_there("var/lib/slsd") else None
    number = next(line.split(":")[2] for line in machine.text("etc/passwd").splitlines() if line.startswith("slsd:"))
    assert owner in (None, int(number)), "the state is another user's"


def loop(machine, rounds):
    """@return how often each was done"""
    done, version, state, mine = {}, None, None, False
    for number in range(rounds):
        what = machine.random.choice(("install", "install", "upgrade", "kill", "calibrate", "edit", "enable", "remove", "purge"))
        done[what] = done.get(what, 0) + 1
        if what in ("install", "upgrade", "kill"):
            version = ("next" if version == "this" else "this") if what == "upgrade" else machine.random.choice(("this", "next"))
            if what == "kill":
                action = machine.random.choice((["--install", *machine.files_of(version)], ["--remove", *reversed(NAMES)],
                                                ["--purge", *reversed(NAMES)]))
                purges = action[0] == "--purge"
                machine.dpkg(*action, kill_after_s=machine.random.uniform(0.02, 1.0))
                if purges:  # begun, it may have taken away what it takes
                    state, mine = None, False
                    machine.repair()
                    machine.dpkg("--purge", *reversed(NAMES))
                machine.repair()
            machine.dpkg("--install", *machine.files_of(version))
            check_installed(machine)
        elif what == "calibrate" and machine.is_there("usr/bin/slsd"):
            state = f"calibration {number}\n"
            folder = machine.root / "var/lib/slsd"
            machine.run("install", "-d", "-o", "slsd", "-g", "slsd", "/var/lib/slsd")  # StateDirectory= does
            (folder / "calibration.yml").write_text(state, encoding="utf-8")
        elif what == "edit" and machine.is_there(CONFIGURATION) and not mine:
            mine = True
            with open(machine.root / CONFIGURATION, "a", encoding="utf-8") as file:
                file.write(MINE)
        elif what == "enable" and machine.is_there("usr/bin/slsd"):
            machine.run("systemctl", "enable", *instances.ENABLED)  # links that a purge has to take away
        elif what == "remove":
            machine.dpkg("--remove", *reversed(NAMES))
            assert not machine.is_there("usr/bin/slsd")
        elif what == "purge":
            machine.dpkg("--purge", *reversed(NAMES))
            left = differences(machine.clean, look(machine.root, machine.sums))
            assert not left, f"after a purge (round {number}):\n" + "\n".join(left[:40])
            state, mine = None, False
        if state is not None:
            assert machine.is_there(CALIBRATION) and machine.text(CALIBRATION) == state, f"{what} (round {number}) lost the calibration"
        if mine:
            assert MINE in machine.text(CONFIGURATION), f"{what} (round {number}) lost the administrator's configuration"
        if (number + 1) % 100 == 0:
            print(f"{number + 1} rounds", flush=True)
    machine.dpkg("--purge", *reversed(NAMES))
    left = differences(machine.clean, look(machine.root, machine.sums))
    assert not left, "at the end:\n" + "\n".join(left[:40])
    return done


def scan_once(machine):
    """From the packages to a cloud of the recorded frame, by the service's user and a member of its group."""
    begin = time.monotonic()
    machine.dpkg("--install", *machine.files_of("this"))
    machine.run("install", "-d", "-o", "slsd", "-g", "slsd", "/run/slsd")
    service = subprocess.Popen(["chroot", "--userspec=slsd:slsd", machine.root, "/usr/bin/slsd", "--config", "/etc/slsd/example.toml"],
                               stderr=subprocess.DEVNULL)
    try:
        while not machine.is_there("run/slsd/example.sock"):
            assert service.poll() is None and time.monotonic() < begin + 120, "the service does not start"
            time.sleep(0.05)
        _, output = machine.run("setpriv", "--reuid=65534", "--regid=65534", "--groups=slsd", "slsctl", "--socket",
                                "/run/slsd/example.sock", "scan", "-o", "/tmp/cloud.ply")
        print(f"packages to first cloud: {time.monotonic() - begin:.1f} s; {output.strip().splitlines()[0]}")
    finally:
        service.terminate()
        service.wait()
    machine.dpkg("--purge", *reversed(NAMES))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("packages", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    with contextlib.ExitStack() as stack:
        subprocess.run(["mount", "--bind", "/proc", root / "proc"], check=True)
        stack.callback(subprocess.run, ["umount", "--lazy", root / "proc"], check=True)
        machine = Machine(root, arguments.packages)
        machine.random.seed(arguments.seed)
        scan_once(machine)
        begin = time.monotonic()
        done = loop(machine, arguments.rounds)
    report(arguments.rounds, begin, done)
    begin, rounds = time.monotonic(), max(3, arguments.rounds // 20)
    with contextlib.closing(Container(root)) as container:
        done = instances.live_with_instances(container, machine.random, rounds, machine.names)
    report(rounds, begin, done, " with instances running")


def report(rounds, begin, done, how=""):
    counts = ", ".join(f"{count} {what}" for what, count in sorted(done.items()))
    print(f"{rounds} rounds{how} in {time.monotonic() - begin:.0f} s ({counts}): nothing lost, nothing left")


if __name__ == "__main__":
    sys.exit(main())
