# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A V4L2 camera over FUSE that shows the scene, and a service on it."""
import pathlib
import subprocess

from service import BIN, SCENE, Service

CANNOT_MOUNT = 77
CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "v4l2"
device = "{device}"
{exposure}
gain_steps = 20
[calibration]
file = "{scene}/calibration.yml"
[server]
socket = "slsd.sock"
"""


class Double:
    """A camera that shows the scene."""

    def __init__(self, rate_hz=60):
        self.plugged = True
        self.process = subprocess.Popen([BIN / "v4l2-double", SCENE / "frame.png", str(rate_hz)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        self.device = pathlib.Path(self.process.stdout.readline().strip())

    def tell(self, command):
        self.plugged = command == "replug" or self.plugged and command != "unplug"
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "ok\n", command

    def mend(self):
        """Ends every fault that lasts."""
        if not self.plugged:
            self.tell("replug")
        for fault in ("drop", "flag", "short", "age", "eio", "stall"):
            self.tell(f"{fault} 0")

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        return self.process.wait()


def service_on(double, exposure="exposure_us = 10000.0"):
    return Service(configuration=CONFIGURATION.format(scene=SCENE, device=double.device, exposure=exposure))


def can_mount():
    """False, with the reason printed, where this machine or user cannot mount FUSE."""
    probe = subprocess.run([BIN / "v4l2-double"], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    print(probe.stderr, end="")
    return probe.returncode != CANNOT_MOUNT
