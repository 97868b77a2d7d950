#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The Python client in several processes and threads: whoever asks gets the answer, and nobody else."""
import copy
import ctypes
import gc
import multiprocessing
import os
import pathlib
import pickle
import signal
import socket
import sys
import tempfile
import threading
import time
import traceback
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon"), str(HERE)]

import numpy as np  # noqa: E402

import patience  # noqa: E402, F401
import slsd  # noqa: E402
from impostor import Impostor, ply, result  # noqa: E402
from service import Service, wait_until  # noqa: E402
from slsd.connection import Connection  # noqa: E402

CHILD_S = 600  # ends what hangs, also on a busy machine


class Child:
    """A function in a child made by fork; `result()` is what it returned, or raises what it raised."""

    def __init__(self, function, fork=os.fork):
        self.reading, writing = os.pipe()
        self.process = fork()
        if self.process == 0:
            signal.alarm(CHILD_S)  # one that hangs fails the test
            try:
                outcome = (True, function())
            except BaseException:
                outcome = (False, traceback.format_exc())
            with os.fdopen(writing, "wb") as out:
                pickle.dump(outcome, out)
            os._exit(0)
        os.close(writing)

    def result(self):
        with os.fdopen(self.reading, "rb") as told:
            data = told.read()
        status = os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])
        assert status == 0, f"the child ended with {status}"
        fine, outcome = pickle.loads(data)
        assert fine, outcome
        return outcome


def echo(request):
    """A cloud that says who asked for it."""
    time.sleep(0.001)
    return result(request, ply(1), bytes=len(ply(1)), asked=request["params"].get("camera"))


def asked(scanner, name, times=60):
    return [scanner.scan(camera=name).description["asked"] for _ in range(times)]


def sockets():
    """What the kernel calls the sockets that this process has."""
    names = []
    for descriptor in os.listdir("/proc/self/fd"):
        try:
            names.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        except OSError:  # the listing's own
            pass
    return {name for name in names if name.startswith("socket:")}


def scans_in_a_worker(scanner, name, times):
    with scanner:
        return asked(scanner, name, times)


class Forking(unittest.TestCase):
    def setUp(self):
        self.service = Impostor(echo)
        self.addCleanup(self.service.__exit__)

    def test_parent_and_children_get_their_own_clouds(self):
        with slsd.Scanner(self.service.path) as scanner:
            self.assertEqual(asked(scanner, "before", 1), ["before"])
            children = [Child(lambda name=f"child {i}": asked(scanner, name)) for i in range(3)]
            self.assertEqual(asked(scanner, "parent"), ["parent"] * 60)
            for i, child in enumerate(children):
                self.assertEqual(child.result(), [f"child {i}"] * 60)

    def test_grandchildren_get_their_own_clouds(self):
        def child():
            grandchild = Child(lambda: asked(scanner, "grandchild"))
            return asked(scanner, "child"), grandchild.result()

        with slsd.Scanner(self.service.path) as scanner:
            below = Child(child)
            self.assertEqual(asked(scanner, "parent"), ["parent"] * 60)
            self.assertEqual(below.result(), (["child"] * 60, ["grandchild"] * 60))

    def test_a_fork_that_python_knows_nothing_of_is_noticed(self):
        fork = ctypes.PyDLL(None).fork  # keeps the interpreter's lock, and runs none of its hooks
        with slsd.Scanner(self.service.path) as scanner:
            child = Child(lambda: asked(scanner, "child"), fork=fork)
            self.assertEqual(asked(scanner, "parent"), ["parent"] * 60)
            self.assertEqual(child.result(), ["child"] * 60)

    def test_a_lock_that_a_thread_of_the_parent_holds_stops_no_child(self):
        waiting, go = threading.Event(), threading.Event()

        def answer(request):
            if request["params"].get("camera") == "slow":
                waiting.set()
                go.wait(CHILD_S)
            return echo(request)

        with Impostor(answer) as service, slsd.Scanner(service.path) as scanner:
            got = []
            thread = threading.Thread(target=lambda: got.extend(asked(scanner, "slow", 1)))
            thread.start()
            waiting.wait(CHILD_S)
            self.assertEqual(Child(lambda: asked(scanner, "child", 3)).result(), ["child"] * 3)
            go.set()
            thread.join()
            self.assertEqual(got, ["slow"])

    def test_what_a_child_closes_or_drops_stays_open_for_the_parent(self):
        def leave():
            nonlocal stream
            with scanner:
                pass
            scanner.close()
            stream = None
            connection.close()
            gc.collect()

        with Service() as service, slsd.Scanner(service.socket) as scanner:
            stream = scanner.stream()
            next(stream)
            connection = Connection(service.socket)
            for _ in range(3):
                Child(leave).result()
                self.assertGreater(len(scanner.scan()), 0)
                self.assertGreater(len(next(stream)), 0)
            ident = connection.send("status", {})
            self.assertEqual(connection.receive(time.monotonic() + CHILD_S)[0]["id"], ident)
            connection.close()
            stream.close()

    def test_a_child_keeps_no_socket_of_the_parent(self):
        before = sockets()
        with slsd.Scanner(self.service.path) as scanner:
            scanner.scan()  # the service has its end
            added = sockets() - before
            self.assertEqual(len(added), 2)  # both ends are in this process
            self.assertEqual(len(added & Child(sockets).result()), 1)

    def test_a_parent_hangs_up_although_its_child_lives(self):
        begin, ended = os.pipe()
        with Service() as service, slsd.Scanner(service.socket) as other:
            stream = slsd.Scanner(service.socket).stream()
            next(stream)
            for fork in (os.fork, ctypes.PyDLL(None).fork):
                child = Child(lambda: os.read(begin, 1), fork=fork)
                stream.close()
                wait_until(lambda: other.status()["subscribers"] == 0, "no subscriber")
                os.write(ended, b"x")
                child.result()
                stream = slsd.Scanner(service.socket).stream()
                next(stream)
            stream.close()
        os.close(begin)
        os.close(ended)

    def test_a_stream_goes_on_in_both(self):
        def frames(count):
            return [next(stream).description["frame"] for _ in range(count)]

        for shared in (False, True):
            with Service() as service, slsd.Scanner(service.socket) as scanner:
                stream = scanner.stream(shared=shared)
                first = frames(3)
                child = Child(lambda: frames(20))
                mine = frames(20)
                theirs = child.result()
                self.assertEqual(first + mine, sorted(set(first + mine)))
                self.assertEqual(theirs, sorted(set(theirs)))
                stream.close()

    def test_a_connection_of_the_parent_is_refused_by_name(self):
        def use(what):
            try:
                what()
            except slsd.ConnectionLost as error:
                return error.name, str(error)
            return None

        for fork in (os.fork, ctypes.PyDLL(None).fork):
            connection = Connection(self.service.path)
            connection.send("scan", {})
            for what in (lambda: connection.send("scan", {}), lambda: connection.receive(None)):
                name, message = Child(lambda what=what: use(what), fork=fork).result()
                self.assertEqual(name, "disconnected")
                self.assertIn("parent process", message)
            self.assertIn("result", connection.receive(time.monotonic() + CHILD_S)[0])
            connection.close()

    def test_clouds_stay_readable_in_the_child_and_are_given_back_with_it(self):
        begin, ended = os.pipe()
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            cloud = scanner.scan()
            depth = float(cloud.points["z"].astype(float).sum())

            def read_later():
                os.read(begin, 1)
                return float(cloud.points["z"].astype(float).sum())

            child = Child(read_later)
            del cloud
            gc.collect()
            os.write(ended, b"x")
            self.assertEqual(child.result(), depth)
            scanner.scan(shared=False)  # another look at who holds what
            wait_until(lambda: scanner.scan() and scanner.status()["clients_memory"]["lent_bytes"] < 1_000_000, "memory given back")
        os.close(begin)
        os.close(ended)


class Workers(unittest.TestCase):
    """Of multiprocessing, however they are started."""

    def test_share_a_scanner_by_fork_or_get_a_copy_of_it(self):
        with Impostor(echo) as service, slsd.Scanner(service.path) as scanner:
            for method in ("fork", "forkserver", "spawn"):
                context = multiprocessing.get_context(method)
                with context.Pool(3) as pool:
                    answers = pool.starmap_async(scans_in_a_worker, [(scanner, f"worker {i}", 20) for i in range(6)])
                    self.assertEqual(asked(scanner, "parent", 20), ["parent"] * 20)
                    for i, got in enumerate(answers.get(CHILD_S)):
                        self.assertEqual(got, [f"worker {i}"] * 20)

    def test_bring_clouds_back(self):
        with Service() as service, slsd.Scanner(service.socket) as scanner:
            with multiprocessing.get_context("fork").Pool(2) as pool:
                clouds = pool.map(slsd.Scanner.scan, [scanner] * 3)
            expected = scanner.scan()
            for cloud in clouds:
                np.testing.assert_array_equal(cloud.points, expected.points)
                self.assertEqual(cloud.comments["units"], expected.comments["units"])
                self.assertEqual(cloud.description["points"], len(expected))
            frame = pickle.loads(pickle.dumps(scanner.frame()))
            np.testing.assert_array_equal(frame.image, scanner.frame().image)


class Copies(unittest.TestCase):
    def test_of_a_scanner_have_a_connection_of_their_own(self):
        with Impostor(echo) as service, slsd.Scanner(service.path) as scanner:
            for other in (pickle.loads(pickle.dumps(scanner)), copy.copy(scanner), copy.deepcopy(scanner)):
                self.assertEqual(asked(other, "copy", 1), ["copy"])
                other.close()
            self.assertEqual(asked(scanner, "first", 1), ["first"])

    def test_are_made_without_the_service_and_find_it_from_another_folder(self):
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
            os.chdir(folder)
            self.addCleanup(os.chdir, before)
            listener.bind("slsd.sock")
            listener.listen()
            with slsd.Scanner("slsd.sock") as scanner:
                data = pickle.dumps(scanner)
            listener.close()
            os.unlink("slsd.sock")
            os.chdir("/")
            scanner = pickle.loads(data)
            with self.assertRaisesRegex(slsd.ConnectionLost, f"{folder}/slsd.sock"):
                scanner.scan()


class Threads(unittest.TestCase):
    def test_get_their_own_clouds(self):
        with Impostor(echo) as service, slsd.Scanner(service.path) as scanner:
            got = {}
            threads = [threading.Thread(target=lambda name=name: got.update({name: asked(scanner, name, 20)}))
                       for name in "abcdefgh"]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(got, {name: [name] * 20 for name in "abcdefgh"})

    def test_one_that_waits_is_told_when_another_closes(self):
        waiting, go = threading.Event(), threading.Event()

        def answer(request):
            waiting.set()
            go.wait(CHILD_S)
            return echo(request)

        told = []

        def wait():
            try:
                scanner.scan(timeout_s=600)
            except slsd.ConnectionLost as error:
                told.append(error)

        with Impostor(answer) as service, slsd.Scanner(service.path) as scanner:
            thread = threading.Thread(target=wait)
            thread.start()
            waiting.wait(CHILD_S)
            scanner.close()
            thread.join(CHILD_S)
            self.assertFalse(thread.is_alive())
            self.assertEqual(len(told), 1)
            go.set()
            self.assertEqual(asked(scanner, "again", 1), ["again"])


if __name__ == "__main__":
    unittest.main()
