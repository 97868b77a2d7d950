#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The Python client against the whole service, and against services that lie, stall and vanish."""
import fcntl
import inspect
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
import unittest.mock

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon"), str(HERE)]

import numpy as np  # noqa: E402

import patience  # noqa: E402, F401
import slsd  # noqa: E402
from impostor import Impostor, ply, result  # noqa: E402
from point_cloud import vertices  # noqa: E402
from python_cost import measure  # noqa: E402
from service import SCENE, Service, wait_until  # noqa: E402


class Scans(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def test_are_the_arrays_that_another_reader_reads(self):
        with slsd.Scanner(self.service.socket) as scanner, self.service.client() as other:
            cloud = scanner.scan()
            description, data = other.call("scan", format="ply")
            self.assertEqual(len(cloud), description["points"])
            self.assertEqual(cloud.description["points"], len(cloud))
            np.testing.assert_array_equal(cloud.xyz, np.array(vertices(data), np.float32))
            self.assertEqual(cloud.comments["scan_id"], cloud.description["scan"])
            for name in ("sigma_mm", "intensity", "camera", "symbol", "column", "row", "camera_u", "projector_v"):
                self.assertIn(name, cloud.points.dtype.names)
            self.assertTrue((cloud.points["sigma_mm"] > 0).all())

    def test_are_not_copied(self):
        with slsd.Scanner(self.service.socket) as scanner:
            points = scanner.scan().points
            self.assertFalse(points.flags.owndata)
            self.assertFalse(points.flags.writeable)
            before = points["z"].copy()
            for _ in range(3):
                scanner.scan()
        np.testing.assert_array_equal(points["z"], before)  # it outlives scans and scanner

    def test_leave_no_descriptor_and_no_memory_behind(self):
        with slsd.Scanner(self.service.socket) as scanner:
            scanner.scan()
            before = len(os.listdir("/proc/self/fd"))
            for _ in range(100):
                scanner.scan()
            self.assertEqual(len(os.listdir("/proc/self/fd")), before)
            wait_until(lambda: scanner.status()["clients_memory"]["lent_bytes"] < 2_000_000, "memory given back")

    def test_of_a_million_points_take_no_memory(self):
        _, allocated, owns = measure(1_000_000, scans=1)
        self.assertFalse(owns)
        self.assertLess(allocated, 1_000_000)

    def test_say_why_they_are_empty(self):
        with slsd.Scanner(self.service.socket) as scanner:
            self.assertIsNone(scanner.scan().why_empty)
        with Service(camera_path=SCENE / "black.png") as dark, slsd.Scanner(dark.socket) as scanner:
            cloud = scanner.scan()
            self.assertIn("no symbol of the pattern was decoded", cloud.why_empty)
            self.assertIn(cloud.why_empty, repr(cloud))

    def test_say_what_one_may(self):
        with slsd.Scanner(self.service.socket) as scanner:
            self.assertEqual(scanner.role, "administer")  # who runs the service

    def test_take_two_lines(self):
        example = [line.strip() for line in inspect.getdoc(slsd).splitlines()[1:] if line]
        self.assertEqual(len(example), 2)
        names = {}
        with unittest.mock.patch.dict(os.environ, {"SLSD_SOCKET": str(self.service.socket)}):
            exec("\n".join(example), names)
        self.assertGreater(len(names["points"]), 100)

    def test_bring_picture_and_frames_where_asked(self):
        with slsd.Scanner(self.service.socket) as scanner:
            cloud = scanner.scan(picture=True, frames=True)
            self.assertTrue(cloud.picture.startswith(b"\x89PNG"))
            self.assertNotIn("reasons", cloud.description)
            why = scanner.scan(picture=True, why=True)
            self.assertNotEqual(why.picture, cloud.picture)
            self.assertTrue(all(reason["remedy"] for reason in why.description["reasons"]))
            self.assertEqual([frame.description["light"] for frame in cloud.frames], ["pattern"])
            frame = scanner.frame()
            np.testing.assert_array_equal(frame.image, cloud.frames[0].image)
            self.assertEqual(frame.image.shape, (frame.description["height_px"], frame.description["width_px"]))
            self.assertTrue(scanner.pattern().startswith(b"\x89PNG"))
            self.assertTrue(scanner.preview().startswith(b"\x89PNG"))

    def test_stream_and_tell_what_was_lost(self):
        with slsd.Scanner(self.service.socket) as scanner:
            stream = scanner.stream()
            frames = [next(stream).description["frame"] for _ in range(5)]
            self.assertEqual(frames, sorted(set(frames)))
            # The socket holds some clouds; the service counts those that then come in vain.
            first = next(stream)
            before = scanner.status()["scans"]["succeeded"]
            wait_until(lambda: scanner.status()["scans"]["succeeded"] > before + 60, "clouds in vain")
            self.assertGreater(sum(next(stream).lost for _ in range(30)), 0)
            self.assertEqual(first.lost, 0)
            stream.close()
            wait_until(lambda: scanner.status()["subscribers"] == 0, "no subscriber")

    def test_errors_have_their_names(self):
        with slsd.Scanner(self.service.socket) as scanner:
            with self.assertRaises(slsd.InvalidRequest) as caught:
                scanner.scan(normals=True)  # of symbols
            self.assertEqual(caught.exception.name, "invalid_params")
            with self.assertRaises(slsd.NotFound):
                scanner.frame("another camera")
            with self.assertRaises(slsd.InvalidRequest):
                next(scanner.stream(rate_hz=-1))
            scanner.project("pattern")
            self.assertEqual(scanner.reload(), [])
            self.assertIn("pattern", scanner.settings())
            self.assertGreater(len(scanner.scan()), 0)  # none of them broke the connection

    def test_threads_may_share_a_scanner(self):
        counts = []
        with slsd.Scanner(self.service.socket) as scanner:
            threads = [threading.Thread(target=lambda: counts.append(len(scanner.scan()))) for _ in range(8)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.assertEqual(len(set(counts)), 1)
        self.assertEqual(len(counts), 8)


class Vanishing(unittest.TestCase):
    def test_is_told_and_the_next_request_connects_anew(self):
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            self.assertGreater(len(scanner.scan()), 0)
            service.stop(signal.SIGKILL)
            with self.assertRaises(slsd.ConnectionLost):
                scanner.scan()
            with self.assertRaises(slsd.ConnectionLost):
                scanner.scan()
            service.socket.unlink(missing_ok=True)
            service.start()
            self.assertGreater(len(scanner.scan()), 0)

    def test_nobody_listening_is_told_with_what_to_do(self):
        with self.assertRaisesRegex(slsd.ConnectionLost, "check that slsd runs"):
            slsd.Scanner("/nonexistent/slsd.sock")

    def test_stalling_ends_in_time(self):
        with Impostor(lambda request: b"") as silent:
            with slsd.Scanner(silent.path) as scanner, self.assertRaises(slsd.TimedOut):
                scanner.scan(timeout_s=0.1)

    def test_stopping_while_a_client_waits_ends_in_time_and_is_overcome(self):
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            stream = scanner.stream(idle_s=10)
            next(stream)
            service.send_signal(signal.SIGSTOP)
            try:
                with self.assertRaises(slsd.TimedOut):
                    while True:
                        next(stream)
                with self.assertRaises(slsd.TimedOut):
                    scanner.scan(timeout_s=0.1)
            finally:
                service.send_signal(signal.SIGCONT)
            self.assertGreater(len(scanner.scan()), 0)
            self.assertGreater(len(next(scanner.stream())), 0)

    def test_accepting_nobody_is_told(self):
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
            path = os.path.join(folder, "slsd.sock")
            listener.bind(path)
            listener.listen(0)
            waiting = []
            with self.assertRaisesRegex(slsd.TimedOut, "does not accept connections"):
                for _ in range(10):
                    waiting.append(slsd.Scanner(path))
            for scanner in waiting:
                scanner.close()

    def test_in_the_middle_of_a_cloud_is_told(self):
        with Impostor(lambda request: result(request, b"ply", bytes=100), hangs_up=True) as cut:
            with slsd.Scanner(cut.path) as scanner, self.assertRaisesRegex(slsd.ConnectionLost, "middle"):
                scanner.scan()


class Ending(unittest.TestCase):
    """Of either side, in the middle of a stream."""

    def test_of_the_service_is_told_and_the_next_stream_finds_it_again(self):
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            stream = scanner.stream()
            next(stream)
            service.stop(signal.SIGKILL)
            with self.assertRaises(slsd.ConnectionLost):
                while True:
                    next(stream)
            service.socket.unlink(missing_ok=True)
            service.start()
            self.assertGreater(len(next(scanner.stream())), 0)

    def test_of_the_program_leaves_nothing_with_the_service(self):
        program = ("import slsd, sys\n"
                   "for cloud in slsd.Scanner(sys.argv[1]).stream(density='pixels'): print(len(cloud), flush=True)\n")
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            for end in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
                reader = subprocess.Popen([sys.executable, "-c", program, service.socket], stdout=subprocess.PIPE,
                                          stderr=subprocess.DEVNULL,
                                          # Shells let what runs in the background ignore it.
                                          preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
                                          env={**os.environ, "PYTHONPATH": str(HERE.parents[1] / "clients/python")})
                reader.stdout.readline()
                reader.send_signal(end)
                reader.wait(600)
                reader.stdout.close()
                wait_until(lambda: scanner.status()["subscribers"] == 0, "no subscriber")
            self.assertGreater(len(scanner.scan(timeout_s=60)), 0)  # behind what was begun for them

    def test_a_stream_that_falls_silent_is_told(self):
        def answer(request):
            return result(request)

        with Impostor(answer) as silent, slsd.Scanner(silent.path) as scanner:
            with self.assertRaises(slsd.TimedOut):
                next(scanner.stream(idle_s=0.2))


class Lies(unittest.TestCase):
    def refused(self, answer, descriptor=None):
        with Impostor(answer, descriptor) as impostor:
            with slsd.Scanner(impostor.path) as scanner, self.assertRaises(slsd.ProtocolError) as caught:
                scanner.scan()
            return str(caught.exception)

    def test_about_json_and_version_are_refused(self):
        self.assertIn("not JSON", self.refused(lambda request: b"220 mail ready\n"))
        self.assertIn("JSON-RPC 2.0", self.refused(lambda request: b'{"id": 1, "result": {}}\n'))
        self.assertIn("JSON-RPC 2.0", self.refused(lambda request: b"[]\n"))
        self.assertIn("1 MiB", self.refused(lambda request: b"x" * (1 << 21)))

    def test_about_sizes_are_refused(self):
        for size in (-1, True, "12", 1 << 60, None, 1.5):
            self.assertIn("announces", self.refused(lambda request: result(request, bytes=size)))
        self.assertIn("is missing", self.refused(lambda request: result(request)))

    def test_about_memory_are_refused(self):
        self.assertIn("no descriptor", self.refused(lambda request: result(request, memfd_bytes=100)))
        descriptor = os.memfd_create("cloud", os.MFD_ALLOW_SEALING)
        size = os.write(descriptor, ply(3))
        try:
            self.assertIn("size", self.refused(lambda request: result(request, memfd_bytes=4096), descriptor))
            self.assertIn("sealed", self.refused(lambda request: result(request, memfd_bytes=size), descriptor))
            fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_WRITE)
            with Impostor(lambda request: result(request, memfd_bytes=size), descriptor) as honest:
                with slsd.Scanner(honest.path) as scanner:
                    self.assertEqual(len(scanner.scan()), 3)
        finally:
            os.close(descriptor)

    def test_of_a_header_are_refused(self):
        for data, reason in ((ply(3, said=4), "but its header says"), (ply(3, said=10**30), "but its header says"),
                             (ply(3)[:-1], "but its header says"), (b"ply\n", "not a binary"), (b"", "not a binary"),
                             (ply(1, lines=["property list uchar int x"]), "an unknown line"),
                             (ply(1, lines=["property float x", "property float x", "property float y"]), "lacks the points"),
                             (ply(3, said=-1), "an unknown line")):
            with self.assertRaisesRegex(slsd.ProtocolError, reason):
                slsd.read_ply(data)
        self.assertEqual(len(slsd.read_ply(ply(3))), 3)
        self.assertEqual(len(slsd.read_ply(ply(0))), 0)

    def test_of_any_kind_raise_nothing_else(self):
        draw = random.Random(5)
        whole = ply(20)
        for _ in range(5000):
            data = bytearray(whole[:draw.randrange(len(whole) + 1)])
            for _ in range(draw.randrange(6)):
                if data:
                    data[draw.randrange(min(len(data), 140))] = draw.randrange(256)
            try:
                slsd.read_ply(data)
            except slsd.ProtocolError:
                pass


if __name__ == "__main__":
    unittest.main()
