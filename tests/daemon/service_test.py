#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service from outside: scans, subscriptions, faults of the camera, life and death."""
import fcntl
import os
import pathlib
import random
import resource
import signal
import socket
import struct
import tempfile
import threading
import time
import unittest

from client import Client, RpcError
from service import SCENE, Service, slsd, wait_until

F_GET_SEALS = 1034
ALL_SEALS = 0xF


def vertices(ply):
    """The depth of each point of a PLY, read without our libraries."""
    header, body = ply.split(b"end_header\n", 1)
    sizes = {"float": 4, "uchar": 1, "int": 4, "ushort": 2, "uint": 4}
    lines = header.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    stride = sum(sizes[line.split()[1]] for line in lines if line.startswith("property"))
    assert len(body) == count * stride
    return [struct.unpack_from("<3f", body, i * stride) for i in range(count)]


class Scan(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def test_gives_the_plane_as_ply(self):
        with self.service.client() as client:
            result, cloud = client.call("scan", format="ply")
        points = vertices(cloud)
        self.assertEqual(len(points), result["points"])
        self.assertGreater(len(points), 2000)
        self.assertTrue(all(abs(z - 2000) < 20 for _, _, z in points))

    def test_gives_pcd_and_names_each_scan(self):
        with self.service.client() as client:
            first, cloud = client.call("scan", format="pcd")
            second, _ = client.call("scan")
        self.assertTrue(cloud.startswith(b"# .PCD"))
        self.assertNotEqual(first["scan"], second["scan"])
        self.assertGreater(second["frame"], first["frame"])

    def test_serves_several_clients_at_once(self):
        scans, problems = [], []

        def work():
            try:
                with self.service.client() as client:
                    for _ in range(5):
                        scans.append(client.call("scan", timeout_ms=60000)[0]["scan"])
            except Exception as problem:  # pylint: disable=broad-except
                problems.append(problem)

        threads = [threading.Thread(target=work) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(problems, [])
        self.assertEqual(len(set(scans)), 30)

    def test_hands_over_a_sealed_memfd(self):
        with self.service.client() as client:
            inline, cloud = client.call("scan")
            result, memory = client.call_for_descriptor("scan", transport="memfd")
            with memory:
                content = memory.read()
                self.assertEqual(fcntl.fcntl(memory, F_GET_SEALS), ALL_SEALS)
        self.assertNotIn("bytes", result)
        self.assertEqual(result["memfd_bytes"], len(content))
        self.assertEqual(inline["points"], result["points"])
        self.assertEqual(vertices(content), vertices(cloud))

    def test_sends_a_picture_before_the_reply(self):
        with self.service.client() as client:
            result, _ = client.call("scan", picture=True)
            (event, picture), = client.events
        self.assertEqual(event["params"]["scan"], result["scan"])
        self.assertTrue(picture.startswith(b"\x89PNG"))

    def test_gives_the_frame_the_pattern_and_a_preview(self):
        with self.service.client() as client:
            raw, pixels = client.call("frame", format="raw")
            _, frame = client.call("frame")
            _, pattern = client.call("pattern")
            _, preview = client.call("preview")
        self.assertEqual((raw["width_px"], raw["height_px"], raw["bits"]), (1600, 1200, 8))
        self.assertEqual(len(pixels), 1600 * 1200)
        for png in (frame, preview):
            self.assertTrue(png.startswith(b"\x89PNG"))
        file = self.service.folder / "pattern.png"
        self.assertEqual(slsd("--pattern", file, "--config", self.service.file).returncode, 0)
        self.assertEqual(file.read_bytes(), pattern)

    def test_tells_its_state(self):
        with self.service.client() as client:
            client.call("scan")
            status, _ = client.call("status")
        self.assertTrue(status["ready"])
        self.assertEqual(status["cameras"][0]["state"], "ready")
        self.assertGreater(status["scans"]["succeeded"], 0)
        self.assertGreater(status["scans"]["regions"]["decoded"], 2000)
        self.assertGreater(status["scans"]["stages_ms"]["describe"]["mean"], 0)

    def test_answers_half_closed_connections(self):
        with self.service.client() as client:
            client.send(b'{"jsonrpc":"2.0","id":1,"method":"status"}')
            client.socket.shutdown(socket.SHUT_WR)
            message, _ = client.receive()
            self.assertIn("result", message)
            self.assertEqual(client.socket.recv(1), b"")

    def test_refuses_wrong_parameters_with_a_hint(self):
        wrong = [("scan", {"formatt": "ply"}, "did you mean format?"), ("scan", {"format": "xyz"}, "ply"),
                 ("scan", {"timeout_ms": 0}, "1 to 600000"), ("scan", {"timeout_ms": 1e99}, "1 to 600000"),
                 ("scan", {"timeout_ms": 2**70}, "1 to 600000"), ("scan", {"picture": 1}, "true or false"),
                 ("subscribe", {"rate_hz": -1}, "above 0"), ("frame", {"camera": 7}, "a text"),
                 ("status", {"verbose": True}, "no such parameter")]
        with self.service.client() as client:
            for method, params, hint in wrong:
                with self.subTest(params=params), self.assertRaises(RpcError) as caught:
                    client.call(method, **params)
                self.assertEqual(caught.exception.code, -32602)
                self.assertIn(hint, str(caught.exception))
            with self.assertRaises(RpcError) as caught:
                client.call("frame", camera="right")
            self.assertEqual(caught.exception.name, "not_found")
            with self.assertRaises(RpcError) as caught:
                client.call("scann")
            self.assertEqual(caught.exception.code, -32601)
            self.assertIn("did you mean scan?", str(caught.exception))


class Rubbish(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service(server="clients_max = 40").start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def tearDown(self):
        with self.service.client() as client:
            self.assertIn("version", client.call("status")[0])

    def test_is_answered_with_an_error_by_line(self):
        lines = {b"hello": -32700, b"{": -32700, b"\xff\xfe\x00": -32700, b'{"jsonrpc":"2.0"': -32700,
                 b"[" * 100000: -32700, b'{"a":' * 100000: -32700, b"[]": -32600, b"7": -32600, b'"x"': -32600,
                 b"null": -32600, b"{}": -32600, b'{"jsonrpc":"1.0","id":1,"method":"status"}': -32600,
                 b'{"jsonrpc":"2.0","id":{},"method":"status"}': -32600,
                 b'{"jsonrpc":"2.0","id":1,"method":7}': -32600,
                 b'[{"jsonrpc":"2.0","id":1,"method":"status"}]': -32600,
                 b'{"jsonrpc":"2.0","id":1,"method":"status","params":[1]}': -32602,
                 b'{"jsonrpc":"2.0","id":1,"method":""}': -32601}
        with self.service.client() as client:
            for line, code in lines.items():
                client.send(line + b"\n")
                self.assertEqual(client.receive()[0]["error"]["code"], code, line[:60])

    def test_of_any_bytes_does_no_harm(self):
        random.seed(1)
        for _ in range(50):
            with self.service.client() as client:
                client.send(random.randbytes(random.randrange(1, 5000)) + b"\n")

    def test_that_is_too_long_ends_the_connection(self):
        with self.service.client() as client:
            try:
                for _ in range(3000):
                    client.send(b"x" * 1024)
            except OSError:
                pass
            self.assertEqual(client.receive()[0]["error"]["code"], -32600)
            with self.assertRaises(OSError):
                client.receive()

    def test_many_notifications_are_not_answered(self):
        with self.service.client() as client:
            client.send(b'{"jsonrpc":"2.0","method":"status"}\n' * 20000)
            self.assertIn("version", client.call("status")[0])

    def test_slow_sender_holds_nobody_up(self):
        with self.service.client() as slow, self.service.client() as other:
            for byte in b'{"jsonrpc":"2.0","id":1,"method":"status"}':
                slow.send(bytes([byte]))
                other.call("status")
            slow.send(b"\n")
            self.assertIn("result", slow.receive()[0])

    def test_too_many_clients_are_told(self):
        clients = [self.service.client() for _ in range(60)]
        try:
            self.assertEqual(clients[-1].receive()[0]["error"]["data"]["name"], "busy")
            self.assertIn("version", clients[0].call("status")[0])
        finally:
            for client in clients:
                client.close()

        def free():
            with self.service.client() as client:
                try:
                    return bool(client.call("status"))
                except (OSError, RpcError):
                    return False
        wait_until(free, "a place for a client")


class Subscription(unittest.TestCase):
    def test_gives_every_cloud_to_who_reads(self):
        with Service() as service, service.client() as client:
            client.call("subscribe", format="ply")
            events = [client.receive() for _ in range(5)]
            frames = [message["params"]["frame"] for message, _ in events]
            self.assertEqual(frames, sorted(set(frames)))
            for message, cloud in events:
                self.assertEqual(message["method"], "cloud")
                self.assertEqual(len(vertices(cloud)), message["params"]["points"])
            client.call("scan")
            client.call("unsubscribe")
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["subscribers"] == 0, "no subscriber")
                time.sleep(0.5)  # a free scan may be under way still
                before = other.call("status")[0]["scans"]["succeeded"]
                time.sleep(0.5)
                self.assertEqual(other.call("status")[0]["scans"]["succeeded"], before)

    def test_slow_reader_loses_clouds_and_holds_nobody_up(self):
        with Service() as service, service.client() as slow, service.client() as quick:
            slow.call("subscribe")
            quick.call("subscribe")
            for _ in range(20):
                quick.receive()
            with service.client() as other:
                other.call("scan")
            lost = [slow.receive()[0]["params"].get("lost", 0) for _ in range(10)]
            self.assertGreater(sum(lost), 0)
            numbers = [slow.receive()[0]["params"]["frame"] for _ in range(3)]
            self.assertEqual(numbers, sorted(set(numbers)))

    def test_reader_that_stopped_is_dropped(self):
        with Service(server="send_timeout_ms = 300") as service, service.client() as stuck:
            stuck.call("subscribe")
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["clients"] == 1, "the stuck client to be dropped")

    def test_rate_is_kept(self):
        with Service() as service, service.client() as client:
            client.call("subscribe", rate_hz=4)
            client.receive()
            begin = time.monotonic()
            for _ in range(4):
                client.receive()
            self.assertGreater(time.monotonic() - begin, 0.7)

    def test_tells_of_failed_scans(self):
        with Service(camera='faults = ["drop@2"]') as service, service.client() as client:
            client.call("subscribe")
            methods = [client.receive()[0]["method"] for _ in range(3)]
            self.assertIn("scan_failed", methods)
            self.assertIn("cloud", methods)


class Faults(unittest.TestCase):
    def expect(self, fault, name, **params):
        """The first scan fails with the name, and the one after it succeeds."""
        with Service(camera=f'faults = ["{fault}"]') as service, service.client() as client:
            with self.assertRaises(RpcError) as caught:
                client.call("scan", **params)
            self.assertEqual(caught.exception.name, name, str(caught.exception))
            result, cloud = client.call("scan")
            self.assertEqual(len(vertices(cloud)), result["points"])
            status = client.call("status")[0]["scans"]
            self.assertEqual(status["failed"], {name: 1})
            self.assertEqual(status["last_error"]["data"]["name"], name)

    def test_each_has_a_name(self):
        for fault, name, params in [("drop@1", "frame_dropped", {}), ("tear@1", "frame_torn", {}),
                                    ("stale@1", "frame_stale", {}), ("disconnect@1", "disconnected", {}),
                                    ("late@1", "frame_late", {"timeout_ms": 1500})]:
            with self.subTest(fault=fault):
                self.expect(fault, name, **params)

    def test_disconnected_camera_comes_back_by_itself(self):
        with Service(camera='faults = ["disconnect@2:500ms"]') as service, service.client() as client:
            client.call("scan")
            with self.assertRaises(RpcError):
                client.call("scan")
            client.call("scan")
            log = service.log_text()
            self.assertEqual(log.count("trying again until it opens"), 1)
            self.assertEqual(log.count("open again"), 1)

    def test_scan_waits_for_a_camera_that_is_still_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            frame = pathlib.Path(folder) / "frame.png"
            with Service(camera_path=frame) as service, service.client() as client:
                with self.assertRaises(RpcError) as caught:
                    client.call("scan", timeout_ms=200)
                self.assertEqual(caught.exception.name, "timeout")
                client.request("scan", timeout_ms=60000)
                part = frame.with_suffix(".part")
                part.write_bytes((SCENE / "frame.png").read_bytes())
                part.rename(frame)
                self.assertGreater(client.reply()[0]["points"], 2000)

    def test_frames_without_a_pattern_give_an_empty_cloud(self):
        for image in ("black.png", "white.png"):
            with Service(camera_path=SCENE / image) as service, service.client() as client:
                result, cloud = client.call("scan")
                self.assertEqual((result["points"], vertices(cloud)), (0, []))

    def test_frame_of_another_size_is_an_error(self):
        with Service(camera_path=SCENE / "small.png") as service, service.client() as client:
            with self.assertRaises(RpcError) as caught:
                client.call("scan")
            self.assertEqual(caught.exception.name, "mismatch")
            self.assertIn("640x480", str(caught.exception))


class Life(unittest.TestCase):
    def test_sigterm_ends_a_waiting_scan_at_once(self):
        with Service(camera='faults = ["stall@1"]') as service, service.client() as client:
            client.request("scan", timeout_ms=60000)
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["cameras"][0]["state"] == "ready", "the camera")
            time.sleep(0.2)
            status, seconds = service.stop()
            self.assertEqual(status, 0)
            self.assertLess(seconds, 5)
            with self.assertRaises(RpcError) as caught:
                client.reply()
            self.assertEqual(caught.exception.name, "cancelled")
            self.assertFalse(service.socket.exists())

    def test_sigterm_while_clouds_flow(self):
        with Service() as service, service.client() as client:
            client.call("subscribe")
            client.receive()
            status, seconds = service.stop(signal.SIGINT)
            self.assertEqual(status, 0)
            self.assertLess(seconds, 5)

    def test_socket_of_a_dead_daemon_is_replaced(self):
        service = Service()
        with service:
            service.process.kill()
            service.process.wait()
            self.assertTrue(service.socket.exists())
            service.launch()

            def answers():
                try:
                    with service.client() as client:
                        return bool(client.call("status"))
                except OSError:
                    return False
            wait_until(answers, "an answer")

    def test_socket_of_a_living_daemon_is_left_alone(self):
        with Service() as service:
            second = slsd("--config", service.file)
            self.assertEqual(second.returncode, 1)
            self.assertIn("another daemon answers there", second.stderr)
            with service.client() as client:
                self.assertIn("version", client.call("status")[0])

    def test_path_that_is_no_socket_is_left_alone(self):
        service = Service()
        service.socket.write_text("precious", encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("no socket", result.stderr)
        self.assertEqual(service.socket.read_text(encoding="utf-8"), "precious")

    def test_path_too_long_is_refused(self):
        service = Service()
        service.file.write_text('[server]\nsocket = "/' + "x" * 107 + '"\n', encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("slsd.toml:2:10: [server] socket must be a path of 1 to 107 bytes", result.stderr)

    def test_folder_that_is_missing_is_named(self):
        service = Service()
        service.file.write_text('[server]\nsocket = "missing/slsd.sock"\n', encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("missing/slsd.sock", result.stderr)

    def test_mode_of_the_socket_is_as_configured(self):
        with Service(server="socket_mode = 0o600") as service:
            self.assertEqual(service.socket.stat().st_mode & 0o777, 0o600)
        with Service() as service:
            self.assertEqual(service.socket.stat().st_mode & 0o777, 0o660)

    def test_bad_reload_changes_nothing(self):
        with Service() as service, service.client() as client:
            client.call("scan")
            service.file.write_text("[pattern]\nsymbol_size = 8\n", encoding="utf-8")
            with self.assertRaises(RpcError) as caught:
                client.call("reload")
            self.assertIn("slsd.toml:2:1", str(caught.exception))
            self.assertIn("did you mean symbol_size_px?", str(caught.exception))
            self.assertGreater(client.call("scan")[0]["points"], 2000)

    def test_reload_takes_decode_options_and_names_what_needs_a_restart(self):
        with Service() as service, service.client() as client:
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text + "clients_max = 7\n[decode]\ndepth_max_mm = 600.0\n", encoding="utf-8")
            self.assertEqual(client.call("reload")[0], {"needs_restart": ["server"]})
            self.assertEqual(client.call("scan")[0]["points"], 0)

    def test_sighup_reloads(self):
        with Service() as service, service.client() as client:
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text + "[decode]\ndepth_max_mm = 600.0\n", encoding="utf-8")
            service.send_signal(signal.SIGHUP)
            wait_until(lambda: "reloaded" in service.log_text(), "the reload")
            self.assertEqual(client.call("scan")[0]["points"], 0)

    def test_manager_is_notified(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "notify")
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
                manager.bind(path)
                manager.settimeout(60)
                service = Service(environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "300000"})
                service.launch()
                messages = []

                def await_message(part):
                    while not messages or part not in messages[-1]:
                        messages.append(manager.recv(4096).decode())
                try:
                    await_message("READY=1")
                    with service.client() as client:
                        client.call("status")
                    await_message("WATCHDOG=1")
                    await_message("WATCHDOG=1")
                    service.send_signal(signal.SIGHUP)
                    await_message("RELOADING=1")
                    self.assertIn("MONOTONIC_USEC=", messages[-1])
                    await_message("READY=1")
                    service.stop()
                    await_message("STOPPING=1")
                finally:
                    service.__exit__()

    def test_runs_out_of_descriptors_and_recovers(self):
        def few_descriptors():
            resource.setrlimit(resource.RLIMIT_NOFILE, (48, 48))
        with Service(preexec=few_descriptors) as service:
            with service.client() as first:
                first.call("status")
                clients = [Client(service.socket) for _ in range(60)]
                wait_until(lambda: "cannot take another client" in service.log_text(), "the limit")
                self.assertIn("version", first.call("status")[0])
                for client in clients:
                    client.close()
            with service.client() as client:
                self.assertIn("version", client.call("status")[0])

    def test_memory_stays_level(self):
        with Service() as service, service.client() as client:
            for _ in range(20):
                client.call("scan")
            before = client.call("status")[0]["resident_bytes"]
            for _ in range(150):
                client.call("scan")
            for _ in range(200):
                with service.client() as other:
                    other.send(b"rubbish\n")
            after = client.call("status")[0]["resident_bytes"]
            self.assertLess(after, before * 1.05 + 1e6)

    def test_starts_without_camera_and_calibration(self):
        with Service(configuration='[server]\nsocket = "slsd.sock"\n') as service, service.client() as client:
            self.assertFalse(client.call("status")[0]["ready"])
            with self.assertRaises(RpcError) as caught:
                client.call("scan")
            self.assertEqual(caught.exception.name, "not_found")
            self.assertTrue(client.call("pattern")[1].startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
