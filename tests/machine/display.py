# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The projector as the second monitor of a graphics card, under slsd-display.service: what it shows is compared with the
pattern, pixel by pixel, from outside the machine."""
import base64
import contextlib
import json
import time

import cameras
from machine import require, wait_for
from pictures import read_png

WIDTH, HEIGHT = 1280, 800
FIRST_HEAD = 0


def pattern(machine):
    machine.run("slsctl", "pattern", "/tmp/pattern.png")
    return read_png(base64.b64decode(machine.shell("base64 -w0 /tmp/pattern.png")[1]))


def differing(screen, picture):
    """@return how many pixels of it are not those of the picture"""
    (width, height, pixels), (wanted_width, wanted_height, grey) = screen, picture
    if (width, height) != (wanted_width, wanted_height):
        return wanted_width * wanted_height
    if pixels[0::3] == pixels[1::3] == pixels[2::3] == grey:
        return 0
    return sum(trio != (value,) * 3 for trio, value in zip(zip(pixels[0::3], pixels[1::3], pixels[2::3]), grey))


def is_exact(machine):
    return differing(machine.screen(), pattern(machine)) == 0


def scan_until_shown(machine, what, timeout_s=60):
    """@return how long it took until a scan succeeds; the second monitor then shows the pattern"""
    _, took = cameras.scan_until_good(machine, what, timeout_s)
    wait_for(lambda: is_exact(machine), f"{what}: the pattern on the second monitor", 30 * machine.slow, 1)
    return took


@contextlib.contextmanager
def display(machine, plugged=True):
    cameras.lay_out_scene(machine)
    machine.plug_monitor(WIDTH, HEIGHT) if plugged else machine.unplug_monitor()
    projector = f'driver = "glfw"\nmonitor = "Virtual-2"\nwidth_px = {WIDTH}\nheight_px = {HEIGHT}'
    machine.configure(cameras.configuration(machine, 'driver = "file"\npath = "/srv/scene/frame.pgm"', projector))
    machine.run("systemctl", "enable", "-q", "slsd-display")
    machine.run("systemctl", "restart", "slsd-display", "slsd")
    try:
        yield
    finally:
        machine.shell("killall -q -CONT Xorg; systemctl disable -q --now slsd-display", check=False)
        machine.plug_monitor(WIDTH, HEIGHT)


def projector_state(machine):
    return json.loads(machine.run("slsctl", "--json", "status")[1])["projector"]["state"]


def projector(machine):
    with display(machine):
        took = scan_until_shown(machine, "the projector", 120)
        shown = differing(machine.screen(), pattern(machine))
        require(shown == 0, f"{shown} pixels differ")
        lit = sum(1 for value in machine.screen(FIRST_HEAD)[2][::997] if value > 200)
        require(lit == 0, "the pattern is on the operator's monitor, too")
    return f"0 of {WIDTH * HEIGHT} pixels of the second monitor differ, the first stays dark; {took:.1f} s to the first cloud"


def projector_unplugged(machine):
    with display(machine):
        scan_until_shown(machine, "before", 120)

        def unplug():
            machine.unplug_monitor()
            wait_for(lambda: projector_state(machine) != "ready", "the status to say that it is gone", 30 * machine.slow, 0.5)
            status, output = machine.scan("--timeout-ms", "2000")
            require(status == 1 and "projector" in output, f"a scan without it: {output}")
        unplug()
        machine.plug_monitor(WIDTH, HEIGHT)
        again = scan_until_shown(machine, "plugged in again")
        unplug()
        machine.plug_monitor(1920, 1080)  # an EDID that does not have the configured size
        wait_for(lambda: "1920x1080" in machine.scan("--timeout-ms", "2000")[1], "the refusal that names the other's size", 30 * machine.slow, 0.5)
        machine.plug_monitor(WIDTH, HEIGHT)  # in its place, with nothing unplugged in between
        back = scan_until_shown(machine, "the first one again")
    return (f"unplugged: scans are refused; plugged in again exact, after {again:.1f} s; one whose EDID has another size is refused with that "
            f"size; the first one again exact, after {back:.1f} s")


def projector_late(machine):
    with display(machine, plugged=False):
        wait_for(lambda: machine.is_active("slsd.service"), "the service", 60 * machine.slow, 0.5)
        status, output = machine.scan("--timeout-ms", "3000")
        require(status == 1, f"a scan without a projector: {output}")
        machine.plug_monitor(WIDTH, HEIGHT)
        took = scan_until_shown(machine, "switched on late", 120)
    return f"switched on after the service: exact, and a cloud after {took:.1f} s"


def server_killed(machine):
    with display(machine):
        scan_until_shown(machine, "before", 120)
        machine.shell("killall -KILL Xorg")
        wait_for(lambda: machine.is_active("slsd-display.service"), "X", 60 * machine.slow, 0.5)
        took = scan_until_shown(machine, "X was killed", 120)
    return f"X killed: exact again, and a cloud after {took:.1f} s"


def server_hung(machine):
    with display(machine):
        scan_until_shown(machine, "before", 120)
        machine.shell("killall -STOP Xorg")
        status, output = machine.scan("--timeout-ms", str(int(4000 * min(machine.slow, 5))))
        begin = time.monotonic()
        machine.run("slsctl", "status", user="alice")
        answered = time.monotonic() - begin
        hung = projector_state(machine)
        machine.shell("killall -CONT Xorg")
        took = scan_until_shown(machine, "X goes on", 60)
    # A pattern that stands needs nothing of X: such a scan may succeed.
    require(status == 0 or "display" in output or "projector" in output, f"a scan while X hangs: {output}")
    scanned = "succeeds" if status == 0 else "is refused"
    return f"X hung (projector {hung}): status answers within {answered:.1f} s, a scan {scanned}; exact after it"
