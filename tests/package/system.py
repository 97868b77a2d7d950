#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The installed packages on a whole Debian with systemd, in a container: system.py ROOT FOLDER_OF_PACKAGES [PART...]. As
root. A line for each proof. What needs drivers of the kernel is not tried here."""
import contextlib
import os
import pathlib
import re
import subprocess
import sys
import time

import lifecycle

PATIENCE_S = 120
SLOW = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))  # limits below are for a machine that does nothing else


class Container:
    def __init__(self, root):
        self.root = root
        self.nspawn = subprocess.Popen(
            ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", "--console=pipe", "-D", root],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd="/")
        try:
            self.init = wait_for(self.first_process, "systemd in the container")
            wait_for(lambda: self.run("systemctl", "is-system-running", check=False)[1].strip() in ("running", "degraded"), "the boot")
        except BaseException:
            self.close()
            raise

    def first_process(self):
        assert self.nspawn.poll() is None, "systemd-nspawn does not start a container here"
        children = pathlib.Path(f"/proc/{self.nspawn.pid}/task/{self.nspawn.pid}/children").read_text(encoding="utf-8").split()
        # Its first child only makes way for the one that becomes the container's init.
        return next((child for child in children if comm_of(child) == "systemd"), None)

    def close(self):
        self.nspawn.terminate()
        try:
            self.nspawn.wait(30)
        except subprocess.TimeoutExpired:
            self.nspawn.kill()
            self.nspawn.wait()

    def run(self, *arguments, user=None, check=True, background=False):
        """@return the exit status, and what it wrote"""
        become = ["runuser", "-u", user, "--"] if user else []
        command = ["nsenter", "-t", self.init, "-m", "-u", "-i", "-n", "-p", "-C", *become, *arguments]
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive"}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment,
                                   stdin=subprocess.DEVNULL, cwd="/")
        if background:
            return process
        output, _ = process.communicate(timeout=PATIENCE_S)
        if check and process.returncode != 0:
            raise AssertionError(f"{' '.join(arguments)}: status {process.returncode}\n{output}")
        return process.returncode, output

    def show(self, unit, what):
        return self.run("systemctl", "show", "--value", "-p", what, unit)[1].strip()

    def configure(self, text):
        (self.root / "etc/slsd/slsd.toml").write_text(text, encoding="utf-8")

    def scan(self, user="alice", output="/tmp/cloud.ply"):
        return self.run("slsctl", "scan", "-o", output, user=user, check=False)


def comm_of(process):
    try:
        return pathlib.Path(f"/proc/{process}/comm").read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.05)
    return value


def require(holds, what):
    if not holds:
        raise AssertionError(what)


def example(container):
    """The scanner of one recorded frame, as the one of slsd.service."""
    text = (container.root / "etc/slsd/example.toml").read_text(encoding="utf-8")
    return text.replace("/run/slsd/example.sock", "/run/slsd/slsd.sock")


def set_up(container):
    """What each part but the first finds."""
    container.configure(example(container))
    container.run("systemctl", "reset-failed", "slsd")
    container.run("systemctl", "restart", "slsd")


def nothing_plugged_in(container):
    begin = time.monotonic()
    container.run("sh", "-c", "apt-get install -y -q --no-install-recommends /packages/this/*.deb")
    require(container.show("slsd.service", "ActiveState") == "active", "slsd.service is not active")
    require(container.show("slsd-display.service", "ActiveState") == "inactive", "slsd-display started unasked")
    for user, groups in (("alice", "slsd"), ("bob", ""), ("carol", "slsd,slsd-admin")):
        container.run("useradd", *(["-G", groups] if groups else []), user)
    status, output = container.scan()
    require(status == 1 and "calibration" in output, f"a scan without a camera says: {output}")
    container.run("systemctl", "start", "slsd@example.socket")
    container.run("slsctl", "--socket", "/run/slsd/example.sock", "scan", "-o", "/tmp/cloud.ply", user="alice")
    return f"active at once; says what is missing; {time.monotonic() - begin:.1f} s from the packages to a cloud of the recorded frame"


def few_rights(container):
    require(container.scan()[0] == 0, "a member of slsd cannot scan")
    process = container.show("slsd.service", "MainPID")
    status = container.run("cat", f"/proc/{process}/status")[1]
    field = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
    require(field["Uid"].split()[0] == container.run("id", "-u", "slsd")[1].strip(), "it does not run as slsd")
    require(int(field["CapEff"], 16) == 1 << 13 == int(field["CapBnd"], 16), f"capabilities {field['CapEff']}, not CAP_NET_RAW alone")
    require(field["NoNewPrivs"] == "1" and field["Seccomp"] == "2", "it may get rights that it has not")
    return "as the user slsd, with CAP_NET_RAW alone, and scans"


def who_may_what(container):
    status, output = container.scan(user="bob")
    require(status == 3 or "group" in output, f"a stranger is told: {output}")
    require(status != 0, "a stranger scans")
    status, output = container.run("slsctl", "project", "white", user="alice", check=False)
    require(status == 1 and "slsd-admin" in output, f"a member of slsd who may not project is told: {output}")
    container.run("slsctl", "project", "idle", user="carol")
    return "slsd scans, slsd-admin projects, a stranger does not get in; each is told which group"


def killed(container):
    before = container.show("slsd.service", "MainPID")
    container.run("sh", "-c", f"kill -9 {before}")
    begin = time.monotonic()
    status, output = container.scan()  # waits at the socket
    took = time.monotonic() - begin
    require(status == 0, f"the scan after kill -9: {output}")
    require(container.show("slsd.service", "MainPID") != before, "it was not killed")
    require(took < 10 * SLOW, f"{took:.1f} s to the next cloud")
    return f"kill -9: who connects meanwhile waits, and has a cloud after {took:.1f} s"


def wrong_configuration(container):
    good = example(container)
    container.configure(good + "whistle = 3\n")
    status, _ = container.run("systemctl", "reload", "slsd", check=False)
    require(status != 0, "a reload with a wrong configuration succeeds")
    require(container.scan()[0] == 0, "a refused reload stops the scanner")
    container.run("systemctl", "restart", "slsd", check=False)
    require(container.show("slsd.service", "ExecMainStatus") == "78", "exit status")
    time.sleep(5 * SLOW)
    require(container.show("slsd.service", "ActiveState") == "failed", "it is tried again though nobody has corrected it")
    output = container.run("systemctl", "status", "slsd", check=False)[1]
    require("whistle" in output and "another version" in output, f"the status names no key: {output}")
    set_up(container)
    require(container.scan()[0] == 0, "it does not come back")
    return "a key of another version is named; a reload is refused; a start is not tried again until somebody corrects it"


def upgrade(container):
    (container.root / "var/lib/slsd/calibration.yml").write_text("mine\n", encoding="utf-8")
    before = container.show("slsd.service", "MainPID")
    scans = container.run("sh", "-c", "while [ ! -e /tmp/enough ]; do slsctl scan -o /tmp/u.ply || exit 1; echo scanned; done", user="alice",
                          background=True)
    for version in ("next", "this"):
        container.run("sh", "-c", f"dpkg --force-confold --force-downgrade -i /packages/{version}/*.deb")
        require(container.show("slsd.service", "ActiveState") == "active", f"not active after {version}")
        after = container.show("slsd.service", "MainPID")
        require(after != before, "an upgrade goes on with the old program")
        before = after
    container.run("touch", "/tmp/enough")
    output, _ = scans.communicate(timeout=PATIENCE_S)
    require(scans.returncode == 0, f"a scan beside an upgrade: {output[-500:]}")
    require((container.root / "var/lib/slsd/calibration.yml").read_text(encoding="utf-8") == "mine\n", "the calibration is gone")
    return f"upgrade and downgrade keep everything; {output.count('scanned')} scans beside them, none failed"


def at_rest(container):
    container.scan()
    time.sleep(2)
    before = len(container.run("journalctl", "-u", "slsd", "-q")[1].splitlines())
    time.sleep(20)
    lines = len(container.run("journalctl", "-u", "slsd", "-q")[1].splitlines()) - before
    process = container.show("slsd.service", "MainPID")
    status = container.run("cat", f"/proc/{process}/status")[1]
    resident_mb = int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024
    maps = container.run("cat", f"/proc/{process}/maps")[1]
    libraries = {line.split()[-1] for line in maps.splitlines() if re.search(r"\.so[.0-9]*$", line)}
    require(lines == 0, f"{lines} lines in the journal within 20 s at rest")
    return f"at rest: no line in the journal in 20 s, {resident_mb:.0f} MB resident, {len(libraries)} libraries"


def removed(container):
    container.run("dpkg", "--remove", *lifecycle.NAMES)
    require(container.show("slsd.service", "ActiveState") == "inactive", "removed, and still active")
    require((container.root / "var/lib/slsd/calibration.yml").exists(), "a removal takes the calibration away")
    container.run("systemctl", "stop", "slsd@example.socket", "slsd@example.service", check=False)
    container.run("dpkg", "--purge", *lifecycle.NAMES)
    for user in ("alice", "bob", "carol"):
        container.run("userdel", user)
    left = [path for path in ("etc/slsd", "var/lib/slsd", "run/slsd", "usr/bin/slsd") if (container.root / path).exists()]
    left += [name for name in ("slsd", "slsd-admin") if re.search(rf"(?m)^{name}:", (container.root / "etc/group").read_text(encoding="utf-8"))]
    left += container.run("sh", "-c", "find /etc/systemd /var/lib/systemd/deb-systemd-helper-enabled -name 'slsd*'")[1].split()
    require(not left, f"a purge leaves {left}")
    return "removal stops it and keeps the state; a purge leaves no file, user or group"


PARTS = (nothing_plugged_in, few_rights, who_may_what, killed, wrong_configuration, upgrade, at_rest, removed)


def main():
    root, packages = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    chosen = sys.argv[3:]
    unknown = set(chosen) - {part.__name__ for part in PARTS}
    if unknown:
        sys.exit(f"no such part: {', '.join(unknown)}; there are: {' '.join(part.__name__ for part in PARTS)}")
    lifecycle.lay_out(root, packages)
    failed = 0
    with contextlib.closing(Container(root)) as container:
        for part in PARTS:
            # The first makes the machine that the others look at.
            if chosen and part.__name__ not in chosen and part is not nothing_plugged_in:
                continue
            try:
                if part is not nothing_plugged_in:
                    set_up(container)
                print(f"ok      {part.__name__}: {part(container)}", flush=True)
            except (AssertionError, TimeoutError, subprocess.TimeoutExpired) as error:
                failed += 1
                print(f"FAILED  {part.__name__}: {error}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
