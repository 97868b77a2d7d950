# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds as a test starts it, and what is on the network: bytes, read by ROS's message definitions alone."""
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

from dds_load import take_domain  # noqa: E402
from service import BIN, wait_until  # noqa: E402

DOMAIN, HELD = take_domain()
LOOPBACK = ["--domain", str(DOMAIN), "--interface", "lo", "--peer", "127.0.0.1"]


class Cdr:
    """Plain CDR, little-endian: what ROS 2 puts on the wire."""

    def __init__(self, data):
        assert data[:2] == b"\x00\x01", data[:4]
        self.data, self.at = data[4:], 0

    def number(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        self.at += size
        return struct.unpack_from("<" + kind, self.data, self.at - size)[0]

    def numbers(self, kind, count):
        return [self.number(kind) for _ in range(count)]

    def text(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at - 1].decode()

    def octets(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at]

    def sequence(self, item):
        return [item() for _ in range(self.number("I"))]

    def header(self):
        return {"stamp": self.number("i") + self.number("I") * 1e-9, "frame_id": self.text()}

    def point_cloud(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"),
                "fields": self.sequence(lambda: (self.text(), self.number("I"), self.number("B"), self.number("I"))),
                "is_bigendian": self.number("B"), "point_step": self.number("I"), "row_step": self.number("I"),
                "data": self.octets(), "is_dense": self.number("B")}

    def camera_info(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"),
                "distortion_model": self.text(), "d": self.sequence(lambda: self.number("d")),
                "k": self.numbers("d", 9), "r": self.numbers("d", 9), "p": self.numbers("d", 12),
                "binning": self.numbers("I", 2), "roi": self.numbers("I", 4) + [self.number("B")]}

    def image(self):
        return {"header": self.header(), "height": self.number("I"), "width": self.number("I"), "encoding": self.text(),
                "is_bigendian": self.number("B"), "step": self.number("I"), "data": self.octets()}

    def transforms(self):
        return self.sequence(lambda: {"header": self.header(), "child": self.text(), "translation": self.numbers("d", 3),
                                      "rotation": self.numbers("d", 4)})

    def diagnostics(self):
        return {"header": self.header(), "status": self.sequence(lambda: {
            "level": self.number("B"), "name": self.text(), "message": self.text(), "hardware_id": self.text(),
            "values": dict(self.sequence(lambda: (self.text(), self.text())))})}


def probe(topic, kind, *more):
    done = subprocess.run([BIN / "dds_probe", "--domain", str(DOMAIN), "--topic", topic, "--type", kind, *more],
                          capture_output=True, timeout=120, check=True)
    samples, data = [], done.stdout
    while data:
        size = struct.unpack_from("<I", data)[0]
        samples.append(Cdr(data[4:4 + size]))
        data = data[4 + size:]
    return samples


def transforms():
    """The newest of /tf_static, by their children."""
    (sample,) = probe("tf_static", "TFMessage", "--latched")
    return {transform["child"]: transform for transform in sample.transforms()}


def turn(quaternion):
    """The rotation that a unit quaternion (x, y, z, w) stands for."""
    x, y, z, w = quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


class Listener:
    """What is published on a topic, as it comes: the newest sample, and a reader of its own process."""

    def __init__(self, topic, kind, *more):
        self.process = subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--topic", topic, "--type", kind, "--count",
                                         "1000000000", "--seconds", "3600", *more], stdout=subprocess.PIPE)
        self.samples, self.count = {}, 0
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        while size := self.process.stdout.read(4):
            self.take(Cdr(self.process.stdout.read(struct.unpack("<I", size)[0])))
            self.count += 1

    def take(self, sample):
        self.samples = {"": sample}

    def next(self):
        """One that came after this was asked for."""
        seen = self.count
        wait_until(lambda: self.count > seen, "a sample")
        return self.samples[""]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(600)
        self.thread.join()
        self.process.stdout.close()


class States(Listener):
    """/diagnostics, the newest of each name."""

    def __init__(self):
        super().__init__("diagnostics", "DiagnosticArray")

    def take(self, sample):
        for status in sample.diagnostics()["status"]:
            self.samples[status["name"]] = status


class Bridge:
    def __init__(self, service, *more, name="left", network=LOOPBACK, **environment):
        self.log = tempfile.TemporaryFile("w+")
        socket = ["--socket", service.socket] if service else []
        self.process = subprocess.Popen([BIN / "slsd-dds", *socket, "--name", name, *network, *more], stderr=self.log,
                                        env={**os.environ, **environment})

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(600)
        finally:
            self.process.kill()
            self.process.wait()
            self.log.close()


FIELDS = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("sigma", 12, 7, 1), ("intensity", 16, 7, 1), ("camera", 20, 2, 1)]
RECORD = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma", "<f4"), ("intensity", "<f4"), ("camera", "u1"),
                   ("padding", "u1", 3)])


def matrix(calibration, key):
    return [float(number) for number in re.search(key + r":.*?data:\s*\[(.*?)\]", calibration, re.S)[1].split(",")]
