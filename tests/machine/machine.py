# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A whole Debian with systemd that the packages are installed on: a container, which is quick, or a guest of QEMU
(guest.py), which has drivers of its own kernel."""
import pathlib
import re
import subprocess
import time

TIMEOUT_S = 120
ENVIRONMENT = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive"}
IDLE_COUNT_S = 0.04  # what look_how_slow() takes on two idle cores of 2020, with no emulation


def require(holds, what):
    if not holds:
        raise AssertionError(what)


def wait_for(condition, what, timeout_s=TIMEOUT_S, pause_s=0.05):
    end = time.monotonic() + timeout_s
    while not (value := condition()):
        if time.monotonic() > end:
            raise TimeoutError(f"{what}: not within {timeout_s:.0f} s")
        time.sleep(pause_s)
    return value


class Machine:
    """What a part of the test may ask of either. Limits of time are for an idle machine without emulation: times `slow`."""

    slow = 1.0

    def start(self, *arguments, user=None, text=None):
        """@return a process, whose `finish(seconds)` gives the exit status and what it wrote"""
        become = ("runuser", "-u", user, "--") if user else ()
        return self.start_as_root((*become, *arguments), text)

    def run(self, *arguments, user=None, check=True, text=None, timeout_s=TIMEOUT_S):
        status, output = self.start(*arguments, user=user, text=text).finish(timeout_s * self.slow)
        if check and status != 0:
            raise AssertionError(f"{' '.join(arguments)}: status {status}\n{output}")
        return status, output

    def shell(self, script, **options):
        return self.run("sh", "-c", script, **options)

    def look_how_slow(self):
        begin = time.monotonic()
        self.shell("i=0; while [ $i -lt 50000 ]; do i=$((i+1)); done", timeout_s=600)
        self.slow = max(1.0, (time.monotonic() - begin) / IDLE_COUNT_S)

    def show(self, unit, what):
        return self.run("systemctl", "show", "--value", "-p", what, unit)[1].strip()

    def is_active(self, unit):
        return self.show(unit, "ActiveState") == "active"

    def write(self, path, text):
        self.run("sh", "-c", 'cat >"$0"', path, text=text)

    def read(self, path):
        return self.run("cat", path)[1]

    def exists(self, path):
        return self.run("test", "-e", path, check=False)[0] == 0

    def journal(self, unit="slsd"):
        return self.run("journalctl", "-u", unit, "-q", "-o", "cat")[1]

    def example(self):
        """The scanner of one recorded frame, as the one of slsd.service."""
        return self.read("/etc/slsd/example.toml").replace("/run/slsd/example.sock", "/run/slsd/slsd.sock")

    def configure(self, text):
        self.write("/etc/slsd/slsd.toml", text)

    def set_up(self, text=None):
        """What each part but the first finds."""
        self.configure(text or self.example())
        self.run("systemctl", "reset-failed", "slsd")
        self.run("systemctl", "restart", "slsd")

    def scan(self, *options, user="alice", output="/tmp/cloud.ply"):
        """@param output  another user's file is refused before the service is asked"""
        return self.run("slsctl", "scan", "-o", output, *options, user=user, check=False)


class Child:
    def __init__(self, process, text):
        self.process, self.text = process, text

    def finish(self, seconds):
        try:
            output, _ = self.process.communicate(self.text, timeout=seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise TimeoutError(f"{' '.join(self.process.args)}: not within {seconds:.0f} s") from None
        return self.process.returncode, output


class Container(Machine):
    has_drivers = False

    def __init__(self, root):
        # What is changed goes with the container, whatever part ends early.
        overlay = ["--volatile=overlay"] if "overlay" in pathlib.Path("/proc/filesystems").read_text(encoding="utf-8").split() else []
        self.nspawn = subprocess.Popen(
            ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", "--console=pipe", *overlay, "-D", root],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd="/")
        try:
            self.init = wait_for(self.first_process, "systemd in the container")
            wait_for(lambda: self.run("systemctl", "is-system-running", check=False)[1].strip() in ("running", "degraded"), "the boot")
        except BaseException:
            self.close()
            raise

    def first_process(self):
        require(self.nspawn.poll() is None, "systemd-nspawn does not start a container here")
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

    def start_as_root(self, arguments, text):
        command = ["nsenter", "-t", self.init, "-m", "-u", "-i", "-n", "-p", "-C", *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=ENVIRONMENT,
                                   stdin=subprocess.DEVNULL if text is None else subprocess.PIPE, cwd="/")
        return Child(process, text)


def comm_of(process):
    try:
        return pathlib.Path(f"/proc/{process}/comm").read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def field_of(text, name):
    return re.search(rf"(?m)^{name}:\s+(.*)$", text)[1]
