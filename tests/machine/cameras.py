# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Cameras by the kernel's own drivers: each shows the recorded frame, so that each cloud is to be the same bytes as that of
the file, or there is an error with a name."""
import base64
import contextlib
import json
import time

from machine import require, wait_for
from pictures import pad, read_png

# The recorded frame, with black to its right, as cameras have no such squares.
WIDTH, HEIGHT = 640, 480
USB = "/dev/v4l/by-id/usb-slsd_Test_Camera_TEST-1-video-index0"
LASTING = ("no calibration", "not allowed")  # what no waiting mends


def configuration(machine, camera, projector='driver = "headless"'):
    return f"""
[pattern]
file = "/usr/share/slsd/example/pattern.toml"
[projector]
{projector}
[[camera]]
name = "camera"
{camera}
[calibration]
file = "/srv/scene/calibration.yml"
[scan]
timeout_ms = {int(5000 * min(machine.slow, 4))}
"""


def lay_out_scene(machine):
    """Once: the frame as raw pixels and as a picture, and a calibration of its size."""
    if machine.exists("/srv/scene/reference"):
        return
    machine.run("mkdir", "-p", "/srv/scene")
    png = base64.b64decode(machine.shell("base64 -w0 /usr/share/slsd/example/frame.png")[1])
    width, height, rows = read_png(png)
    require(height == HEIGHT, f"the recorded frame is {width}x{height}")
    text = base64.b64encode(pad(width, rows, WIDTH)).decode()
    machine.shell("base64 -d >/srv/scene/frame.raw", text=text)
    machine.shell(f"{{ printf 'P5\\n{WIDTH} {HEIGHT}\\n255\\n'; cat /srv/scene/frame.raw; }} >/srv/scene/frame.pgm")
    calibration = machine.read("/usr/share/slsd/example/calibration.yml")
    machine.write("/srv/scene/calibration.yml", calibration.replace(f"      width: {width}\n", f"      width: {WIDTH}\n"))
    machine.set_up(configuration(machine, 'driver = "file"\npath = "/srv/scene/frame.pgm"'))
    status, output = machine.scan()
    require(status == 0, output)
    machine.shell(f"{CLOUD_SUM} >/srv/scene/reference")


CLOUD_SUM = "sed '1,/^end_header$/d' /tmp/cloud.ply | sha256sum"


def is_right(machine):
    return machine.shell(CLOUD_SUM)[1] == machine.read("/srv/scene/reference")


def scan_until_good(machine, what, patience_s):
    """Every answer is a right cloud or an error. @return the errors until there was one, and how long it took"""
    errors, begin = [], time.monotonic()
    while True:
        status, output = machine.scan()
        if status == 0 and is_right(machine):
            return errors, time.monotonic() - begin
        if status == 0:  # a device that was disturbed may give black frames, in which nothing is to be found
            require(": 0 points" in output, f"{what}: a wrong cloud: {output}")
            status, output = 1, "slsctl: an empty cloud of a black frame"
        require(status == 1 and output.startswith("slsctl: "), f"{what}: status {status}: {output}")
        require(not any(words in output for words in LASTING), f"{what}: {output}")
        errors.append(output.strip().removeprefix("slsctl: "))
        require(time.monotonic() < begin + patience_s * machine.slow, f"{what}: no cloud again; {errors[-1]}")


def state_of(machine, number=0):
    return json.loads(machine.run("slsctl", "--json", "status")[1])["cameras"][number]


@contextlib.contextmanager
def usb(machine, camera=""):
    """A USB camera of vhci_hcd that the service has. @return what tells it a command"""
    lay_out_scene(machine)
    machine.run("modprobe", "-a", "vhci-hcd", "uvcvideo")
    machine.shell("rm -f /run/usb-camera; mkfifo /run/usb-camera; systemctl reset-failed usb-camera 2>/dev/null; "
                  f"systemd-run -q --unit=usb-camera /usr/local/bin/usb-camera TEST-1 {WIDTH}x{HEIGHT} 15 /srv/scene/frame.raw /run/usb-camera")
    try:
        wait_for(lambda: machine.exists(USB), "the camera's name in /dev/v4l/by-id", 60 * machine.slow, 0.3)
        machine.set_up(configuration(machine, f'driver = "v4l2"\ndevice = "{USB}"\n{camera}'))
        scan_until_good(machine, "the first scan", 60)
        yield lambda command: machine.shell(f"echo {command} >/run/usb-camera")
    finally:
        machine.shell("echo stall 0 >/run/usb-camera; echo unplug >/run/usb-camera; sleep 0.5; systemctl stop usb-camera", check=False)


def usb_camera(machine):
    with usb(machine, "exposure_us = 16700.0"):
        require("control 1.4 = 167" in machine.journal("usb-camera"), "the exposure did not arrive")
        status, output = machine.run("slsctl", "frame", "/tmp/frame.png", user="alice", check=False)
        require(status == 0, output)
        count = 5
        for _ in range(count):
            status, output = machine.scan()
            require(status == 0 and is_right(machine), output)
        status, output = machine.run("slsd", "--list", user="slsd", check=False)
        require("TEST-1" in output, f"slsd --list: {output}")
    return f"uvcvideo: {count} clouds, the same bytes as of the file; the exposure arrives; the name holds"


def usb_faults(machine):
    told = []
    with usb(machine) as tell:
        for fault, mend in (("err 3", ""), ("short 3", ""), ("drop 20", ""), ("fail 5", ""), ("hang", ""), ("stall 1", "stall 0")):
            tell(fault)
            if mend:
                status, output = machine.scan("--timeout-ms", "1500")
                require(status == 1, f"a scan of a camera that sends nothing: {output}")
                tell(mend)
            errors, took = scan_until_good(machine, fault, 30)
            told.append(f"{fault}: {took:.1f} s" + (f", {len(errors)} refused" if errors else ""))
    return f"uvcvideo with faults, no wrong cloud ({'; '.join(told)})"


def usb_unplugged(machine):
    times = []
    with usb(machine) as tell:
        for number in range(3):
            scans = machine.start("sh", "-c", "while slsctl scan -o /tmp/u.ply; do :; done", user="alice") if number else None
            tell("unplug")
            wait_for(lambda: not machine.exists(USB), "the name to go", 30 * machine.slow, 0.2)
            if scans:
                _, output = scans.finish(60 * machine.slow)
                require("slsctl: " in output, f"a scan while it is unplugged: {output[-200:]}")
            status, output = machine.scan("--timeout-ms", "1000")
            require(status == 1 and ("cable" in output or "gone" in output or "plug it in" in output), f"a scan without it: {output}")
            require(state_of(machine)["state"] != "ready", "the status says that it is ready")
            tell("plug")
            times.append(scan_until_good(machine, "plugged in again", 30)[1])
    took = ", ".join(f"{each:.1f}" for each in times)
    return f"unplugged at rest and in the middle of scans: named; plugged in again a right cloud after {took} s"


def hung_camera(machine):
    with usb(machine) as tell:
        tell("stall 1")
        scan = machine.start("slsctl", "scan", "-o", "/tmp/u.ply", user="alice")
        time.sleep(1)
        begin = time.monotonic()
        machine.run("systemctl", "stop", "slsd.socket", "slsd.service")
        took = time.monotonic() - begin
        require(machine.show("slsd.service", "Result") == "success", f"the stop's result: {machine.show('slsd.service', 'Result')}")
        status, output = scan.finish(30 * machine.slow)
        require(status != 0, f"a scan of a camera that sends nothing: {output}")
        machine.run("systemctl", "start", "slsd.socket", "slsd.service")
    return f"stop while a camera hangs in a scan: {took:.1f} s, and the scan is told"
