#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The examples for controllers pick a box of the recorded cell over slsd-tcp: the one in C is compiled, the URScript runs as
Python, whose syntax differs little, with the controller's functions from here."""
import math
import os
import pathlib
import re
import socket
import subprocess
import tempfile
import unittest

import numpy as np

from seam import CELL
from tcp_service import TOKEN, Tcp
from examples_test import recorded
from service import TIMEOUT_S

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "clients/tcp/examples"
# The front of the topmost box is 220x180 mm about (-180, 150) at 1920 mm, turned by 12 degrees.
MIDDLE_MM, DEPTH_MM, TURN_DEG = (-180, 150), 1920, 12
# A robot that stands beside the scanner and sees the wall as its table.
BASE_FROM_SCANNER = np.array([[1, 0, 0, 400], [0, -1, 0, 100], [0, 0, -1, 2000]], dtype=float)
PARTS_MIN, PARTS_MAX = (50, -200, 60), (400, 100, 100)


def expected(tcp):
    """Middle and turn by numpy, of the same cloud."""
    with tcp.client() as client:
        result, ply = client.call("scan", density="symbols")
    record = np.dtype([("xyz", "<f4", 3), ("rest", "V31")])
    points = np.frombuffer(ply, record, result["points"], ply.index(b"end_header\n") + 11)["xyz"].astype(float)
    placed = points @ BASE_FROM_SCANNER[:, :3].T + BASE_FROM_SCANNER[:, 3]
    part = placed[((placed >= PARTS_MIN) & (placed <= PARTS_MAX)).all(axis=1)]
    spread = np.cov(part[:, :2].T)
    return part.mean(axis=0), math.degrees(math.atan2(2 * spread[0, 1], spread[0, 0] - spread[1, 1]) / 2), len(part)


class Halted(Exception):
    pass


class Pose(list):
    """x y z and a rotation vector, as URScript has them."""

    def matrix(self):
        vector = np.array(self[3:], dtype=float)
        angle = np.linalg.norm(vector)
        x, y, z = vector / angle if angle else vector
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        made = np.eye(4)
        made[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
        made[:3, 3] = self[:3]
        return made


class Controller:
    """What URScript offers its programs, as its manual describes it; movements are noted."""

    def __init__(self):
        self.sockets, self.moves, self.said, self.outputs = {}, [], [], []

    def socket_open(self, address, port, name):
        self.sockets[name] = socket.create_connection((address, port), TIMEOUT_S)
        self.stream = self.sockets[name].makefile("rb")
        return True

    def socket_close(self, name):
        self.sockets.pop(name).close()

    def socket_send_string(self, text, name):
        self.sockets[name].sendall(text.encode("ascii"))

    def socket_send_byte(self, byte, name):
        self.sockets[name].sendall(bytes([byte]))

    def socket_read_byte_list(self, count, name, timeout):
        assert 0 < count <= 30 and timeout > 0 and name in self.sockets
        return [count, *self.stream.read(count)]

    def popup(self, text, title, warning, error, blocking):
        assert (title, warning, error, blocking) == ("Scanner", False, True, True)
        self.said.append(text)

    def names(self):
        own = {name: getattr(self, name) for name in dir(self) if name.startswith(("socket_", "popup"))}
        return {**own, "Pose": Pose, "Halted": Halted, "length": len, "pow": pow, "floor": math.floor, "atan2": math.atan2,
                "pose_trans": lambda a, b: Moved(Pose(a).matrix() @ Pose(b).matrix() if not isinstance(b, Moved) else Pose(a).matrix() @ b.pose),
                "get_inverse_kin": lambda pose: pose, "movej": lambda pose, a, v: self.moves.append(pose),
                "movel": lambda pose, a, v: self.moves.append(pose), "sleep": lambda s: None,
                "set_standard_digital_out": lambda n, on: self.outputs.append((n, on))}


class Moved(list):
    """The pose that a product gives: its place by index, and the whole."""

    def __init__(self, pose):
        super().__init__(pose[:3, 3])
        self.pose = pose


def as_python(script):
    """URScript as Python: blocks without their end, poses as calls."""
    lines = [re.sub(r"\bp\[([^\[\]]*(?:\[[^\[\]]*\][^\[\]]*)*)\]", r"Pose([\1])", re.sub(r"^(\s*)local ", r"\1", line))
             for line in script.splitlines() if line.strip() != "end"]
    return "\n".join(re.sub(r"^(\s*)halt$", r"\1raise Halted()", line) for line in lines) + "\n"


class Controllers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = recorded(CELL / "left").start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.tcp = cls.enterClassContext(Tcp(cls.service.socket))
        cls.middle, cls.turn_deg, cls.points = expected(cls.tcp)
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.program = pathlib.Path(folder.name, "pick")
        pose = "{" + ",".join("{" + ",".join(map(str, row)) + "}" for row in BASE_FROM_SCANNER) + "}"
        box = [f"-D{name}={{{','.join(map(str, corner))}}}" for name, corner in (("PARTS_MIN", PARTS_MIN), ("PARTS_MAX", PARTS_MAX))]
        for flags in ([], [f"-DBASE_FROM_SCANNER={pose}", *box]):
            subprocess.run([os.environ.get("CC", "cc"), "-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags,
                            EXAMPLES / "pick.c", "-lm", "-o", cls.program], check=True, timeout=120)

    def run_c(self, token=TOKEN, port=None):
        done = subprocess.run([self.program, "127.0.0.1", str(port or self.tcp.port), token], capture_output=True, text=True, timeout=TIMEOUT_S,
                              check=False)
        return done.returncode, done.stdout, done.stderr

    def script(self, token=TOKEN, corner=PARTS_MIN):
        text = (EXAMPLES / "pick.script").read_text(encoding="utf-8")
        metres = {"parts_min": corner, "parts_max": PARTS_MAX}
        changes = {"scanner_address": '"127.0.0.1"', "scanner_port": str(self.tcp.port), "token": f'"{token}"',
                   "base_from_scanner": "p[0.4, 0.1, 2.0, 3.14159265, 0, 0]", **{name: str([v / 1000 for v in at]) for name, at in metres.items()}}
        for name, value in changes.items():
            text, count = re.subn(rf"(?m)^  {name} = .*$", f"  {name} = {value}", text)
            self.assertEqual(count, 1, name)
        controller = Controller()
        names = controller.names()
        exec(compile(as_python(text), "pick.script", "exec"), names)  # pylint: disable=exec-used
        try:
            names["pick_part"]()
        except Halted:
            pass
        return controller

    def test_the_part_is_where_the_scene_has_it(self):
        """Of what both examples are compared with."""
        back = (self.middle - BASE_FROM_SCANNER[:, 3]) @ BASE_FROM_SCANNER[:, :3]
        self.assertGreater(self.points, 50)
        self.assertLess(np.abs(back[:2] - MIDDLE_MM).max(), 10)
        self.assertLess(abs(back[2] - DEPTH_MM), 1)
        self.assertLess(abs(self.turn_deg + TURN_DEG), 8)  # seen from above it turns the other way

    def test_the_one_in_c_picks_it(self):
        status, out, error = self.run_c()
        self.assertEqual((status, error), (0, ""))
        *place, turn, points = map(float, re.fullmatch(r"x (\S+) y (\S+) z (\S+) mm, turned (\S+) degrees, (\d+) points\n", out).groups())
        np.testing.assert_allclose(place, self.middle, atol=0.01)
        self.assertAlmostEqual(turn, self.turn_deg, delta=0.02)
        self.assertEqual(points, self.points)

    def test_the_one_in_c_says_what_is_wrong(self):
        status, out, error = self.run_c(token="wrong" * 4)
        self.assertEqual((status, out), (1, ""))
        self.assertIn("that is not the token of this scanner", error)
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            status, _, error = self.run_c(port=unused.getsockname()[1])
        self.assertEqual((status, error), (1, "pick: nothing answers there: 127.0.0.1\n"))

    def test_the_urscript_picks_it(self):
        controller = self.script()
        self.assertEqual((controller.said, controller.outputs, controller.sockets), ([], [(0, True)], {}))
        above, grip, last = controller.moves
        np.testing.assert_allclose(np.array(grip) * 1000, self.middle, atol=0.01)
        np.testing.assert_allclose(np.array(above) - grip, (0, 0, 0.1), atol=1e-6)
        self.assertEqual(above, last)
        np.testing.assert_allclose(grip.pose[:3, 2], (0, 0, -1), atol=1e-6)  # the tool points down
        self.assertAlmostEqual(math.degrees(math.atan2(grip.pose[1, 0], grip.pose[0, 0])), self.turn_deg, delta=0.02)

    def test_the_urscript_moves_nothing_without_a_part_or_a_token(self):
        for options, text in (({"token": "wrong" * 4}, "the scanner refused"), ({"corner": (50, -200, 99.9)}, "no part lies there")):
            controller = self.script(**options)
            self.assertEqual((controller.moves, controller.outputs), ([], []))
            self.assertEqual(len(controller.said), 1)
            self.assertTrue(controller.said[0].startswith(text), controller.said)


if __name__ == "__main__":
    unittest.main(verbosity=2)
