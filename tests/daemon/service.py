# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Starts a real slsd on a configuration of its own, for the tests of the whole service."""
import atexit
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

from client import Client

BIN = pathlib.Path(os.environ["SLSD_BIN"])
SCENE = pathlib.Path(os.environ["SLSD_SCENE"])
TIMEOUT_S = 600  # ends what hangs, also on a busy machine
REPORTS = ("ThreadSanitizer", "AddressSanitizer", "LeakSanitizer", "runtime error:")

CONFIGURATION = """
[pattern]
file = "{scene}/pattern.toml"
[[camera]]
name = "camera"
driver = "file"
path = "{camera_path}"
{camera}
[calibration]
file = "{scene}/calibration.yml"
[scan]
timeout_ms = 600000
reopen_first_ms = 20
reopen_longest_ms = 50
[server]
socket = "slsd.sock"
{server}
"""


def wait_until(condition, what):
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.01)


class Service:
    def __init__(self, camera_path=None, camera="", server="", configuration=None, environment=None, preexec=None,
                 program="slsd"):
        self.program = program
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-"))
        atexit.register(shutil.rmtree, self.folder, ignore_errors=True)
        self.file = self.folder / "slsd.toml"
        self.socket = self.folder / "slsd.sock"
        self.log = self.folder / "log"
        self.configure(camera_path=camera_path, camera=camera, server=server, configuration=configuration)
        self.environment = {**os.environ, **(environment or {})}
        self.preexec = preexec
        self.process = None

    def configure(self, camera_path=None, camera="", server="", configuration=None):
        text = configuration or CONFIGURATION.format(
            scene=SCENE, camera_path=camera_path or SCENE / "frame.png", camera=camera, server=server)
        self.file.write_text(text, encoding="utf-8")

    def launch(self):
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen([BIN / self.program, "--config", self.file, "--log-level", "debug"], stderr=log,
                                            env=self.environment, preexec_fn=self.preexec)

    def start(self):
        self.launch()
        wait_until(lambda: self.socket.exists() or self.process.poll() is not None, "the socket")
        if self.process.poll() is not None:
            raise RuntimeError(self.log_text())
        return self

    def wait_ready(self):
        """Until the projector and the cameras are open: what a scan then takes is its own."""
        with self.client() as client:
            wait_until(lambda: client.call("status")[0]["ready"], "the devices")

    def log_text(self):
        return self.log.read_text(encoding="utf-8")

    def check_sanitizers(self):
        """Their reports are lines of the log, and may be all that tells of what they found."""
        if os.environ.get("SLSD_SANITIZE") and self.log.exists():
            text = self.log.read_text(encoding="utf-8", errors="replace")
            at = min((text.find(sign) for sign in REPORTS if sign in text), default=None)
            assert at is None, text[max(0, at - 200):at + 8000]

    def client(self, **options):
        return Client(self.socket, **options)

    def send_signal(self, number):
        self.process.send_signal(number)

    def stop(self, number=signal.SIGTERM):
        """The exit status and the seconds that it took."""
        begin = time.monotonic()
        self.send_signal(number)
        status = self.process.wait(TIMEOUT_S)
        self.check_sanitizers()
        return status, time.monotonic() - begin

    def __enter__(self):
        return self.start()

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.check_sanitizers()


def slsd(*arguments, **options):
    return subprocess.run([BIN / "slsd", *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT_S,
                          check=False, **options)


def slsctl(*arguments, **options):
    return subprocess.run([BIN / "slsctl", *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT_S,
                          check=False, **options)
