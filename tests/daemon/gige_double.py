# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A GigE Vision camera on a loopback address that shows the scene, and a service on it."""
import subprocess

from service import BIN, SCENE, Service

CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "aravis"
id = "{address}"
{camera}
[calibration]
file = "{scene}/calibration.yml"
[server]
socket = "slsd.sock"
"""


class Double:
    """A camera that shows the scene; without an address, on one that is free. Options are those of gige-camera."""

    def __init__(self, *options):
        self.options = options
        self.address = None
        self.process = None
        self.plug_in()

    def plug_in(self):
        where = ["--address", self.address] if self.address else []
        self.process = subprocess.Popen([BIN / "gige-camera", "--images", SCENE / "frame.png", *self.options, *where],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        assert self.address, "the double does not start"

    def unplug(self):
        """As when it loses its power: nothing says goodbye."""
        self.process.kill()
        self.close()

    def tell(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "ok\n", command

    def status(self):
        """What became of its frames and packets, in words."""
        self.process.stdin.write("status\n")
        self.process.stdin.flush()
        words = self.process.stdout.readline().strip()
        assert self.process.stdout.readline() == "ok\n"
        return words

    def mend(self):
        """Ends every fault that lasts."""
        if self.process.poll() is not None:
            self.plug_in()
        for fault in ("gone", "occupy", "silent"):
            self.tell(f"{fault} 0")

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        return self.process.wait()


def service_on(double, camera=""):
    return Service(configuration=CONFIGURATION.format(scene=SCENE, address=double.address, camera=camera))
