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

# The recorded frame, with black to its right: a width that vivid has a timing for.
WIDTH, HEIGHT = 640, 480
USB = "/dev/v4l/by-id/usb-slsd_Test_Camera_TEST-1-video-index0"
CAMERA_ADDRESS, HOST_ADDRESS = "10.77.0.2", "10.77.0.1"
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


def scan_until_good(machine, what, timeout_s):
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
        require(time.monotonic() < begin + timeout_s * min(machine.slow, 10), f"{what}: no cloud again; {errors[-1]}")


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


def vivid(machine):
    lay_out_scene(machine)
    machine.shell("modprobe vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=0x3 num_outputs=1 output_types=0x1")
    find = "grep -l {} /sys/class/video4linux/*/name | head -n 1 | xargs dirname | xargs basename"
    capture, shown = (wait_for(lambda kind=kind: machine.shell(find.format(kind), check=False)[1].strip(), "vivid's devices")
                      for kind in ("vid-cap", "vid-out"))
    for device in (capture, shown):
        machine.run("v4l2-ctl", "-d", f"/dev/{device}", "--set-dv-bt-timings", f"cvt,width={WIDTH},height={HEIGHT},fps=60,reduced-blanking=2")
    machine.run("v4l2-ctl", "-d", f"/dev/{capture}", "-c", "osd_text_mode=2,loop_video=1")
    size = f"width={WIDTH},height={HEIGHT},pixelformat=GREY"
    machine.run("v4l2-ctl", "-d", f"/dev/{shown}", f"--set-fmt-video-out={size}")
    machine.run("v4l2-ctl", "-d", f"/dev/{capture}", f"--set-fmt-video={size}")
    # A fatal error ends both ends of the loop.
    machine.run("systemd-run", "-q", "--unit=vivid-shows", "-p", "Restart=always", "-p", "StartLimitIntervalSec=0", "v4l2-ctl", "-d", f"/dev/{shown}", "--stream-out-mmap",
                "--stream-from=/srv/scene/frame.raw", "--stream-loop")
    told = []
    try:
        machine.set_up(configuration(machine, f'driver = "v4l2"\ndevice = "/dev/{capture}"\nformat = "GREY"\n'
                                              f"width_px = {WIDTH}\nheight_px = {HEIGHT}"))
        scan_until_good(machine, "the first scan", 60)
        for fault in ("inject_v4l2_buf_flag_error=1", "inject_vidioc_qbuf_error=1", "inject_vidioc_streamon_error=1",
                      "inject_fatal_streaming_error=1", "disconnect=1"):
            machine.run("v4l2-ctl", "-d", f"/dev/{capture}", "-c", fault)
            errors, took = scan_until_good(machine, fault, 30)
            told.append(f"{fault.split('=')[0]}: {took:.1f} s" + (f", {len(errors)} refused" if errors else ""))
        machine.shell("echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind")
        status, output = machine.scan("--timeout-ms", "1000")
        require(status == 1, f"a scan of a device that is gone: {output}")
    finally:
        machine.run("systemctl", "stop", "vivid-shows", check=False)
        machine.shell("systemctl stop slsd; rmmod vivid", check=False)
    return f"vivid with injected faults, no wrong cloud ({'; '.join(told)})"


@contextlib.contextmanager
def camera_network(machine, loss):
    """A network of two: this host, and the camera on the other end of a cable, which loses packets."""
    machine.shell("set -e; ip netns add camera; ip link add cam0 type veth peer name cam1 netns camera; "
                  f"ip addr add {HOST_ADDRESS}/24 dev cam0; ip link set cam0 up; ip netns exec camera ip addr add {CAMERA_ADDRESS}/24 dev cam1; "
                  "ip netns exec camera ip link set cam1 up; ip netns exec camera ip link set lo up; "
                  + (f"ip netns exec camera tc qdisc replace dev cam1 root netem loss {loss}; " if loss else ""))
    try:
        yield
    finally:
        machine.shell("systemctl stop gige; ip link del cam0; ip netns del camera", check=False)


def start_in_network(machine, command):
    machine.shell("systemctl reset-failed gige 2>/dev/null; systemd-run -q --unit=gige "
                  f"--setenv=SLSD_GIGE_DESCRIPTION=/usr/local/bin/camera.xml sh -c 'sleep infinity | ip netns exec camera {command}'")


def gige(machine):
    count = 10
    lay_out_scene(machine)
    with camera_network(machine, "1%"):
        start_in_network(machine, f"/usr/local/bin/gige-camera --address {CAMERA_ADDRESS} --images /srv/scene/frame.pgm")
        machine.set_up(configuration(machine, f'driver = "aravis"\nid = "{CAMERA_ADDRESS}"'))
        scan_until_good(machine, "the first scan", 60)
        refused = 0
        for _ in range(count):
            errors, _ = scan_until_good(machine, "1 % lost", 30)
            refused += len(errors)
        lost = machine.shell("ip netns exec camera tc -s qdisc show dev cam1")[1].split("dropped ")[1].split(",")[0]
        machine.run("systemctl", "kill", "-s", "KILL", "gige")
        status, output = machine.scan("--timeout-ms", "3000")
        require(status == 1, f"a scan of a camera without power: {output}")
        machine.run("systemctl", "stop", "gige", check=False)
        start_in_network(machine, f"/usr/local/bin/gige-camera --address {CAMERA_ADDRESS} --images /srv/scene/frame.pgm")
        _, took = scan_until_good(machine, "its power is back", 60)
    require(refused <= count // 5, f"{refused} refused of {count}")
    return (f"GigE Vision over a cable that loses 1 %: {count} of {count} clouds the same bytes as of the file, {refused} tried again, {lost} "
            f"packets lost; its power cut: a right cloud after {took:.1f} s")


def gige_of_others(machine):
    lay_out_scene(machine)
    with camera_network(machine, None):
        start_in_network(machine, f"/usr/local/bin/arv-fake-gv-camera-0.8 -i {CAMERA_ADDRESS} -s FAKE1")
        machine.set_up(configuration(machine, f'driver = "aravis"\nid = "{CAMERA_ADDRESS}"'))

        def frame():
            return machine.run("slsctl", "frame", "/tmp/frame.png", "--timeout-ms", "20000", user="alice", check=False)
        wait_for(lambda: frame()[0] == 0, "a frame of Aravis' fake camera", 60 * machine.slow, 0.5)
        told = [frame() for _ in range(5)]
        errors = [output.strip() for status, output in told if status != 0]
        # It sends no packet again: one that is lost, as where nobody reads in time, is a frame lost, and named.
        require(len(errors) <= 1 and all("frame" in error for error in errors), f"of 5 frames: {errors}")
        status, output = machine.scan()
        require(status == 1, f"a scan of its test picture: {output}")
    return f"Aravis' fake camera: {5 - len(errors)} of 5 frames; a scan of its test picture says: {output.strip().removeprefix('slsctl: ')[:80]}"
