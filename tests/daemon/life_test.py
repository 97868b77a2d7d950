#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service from its start to its end: its socket, its signals, what it loads anew and what it uses up."""
import contextlib
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

from client import Client, RpcError
from service import BIN, SCENE, Service, slsd, wait_until


class Life(unittest.TestCase):
    def test_sigterm_ends_a_waiting_scan_at_once(self):
        with Service(camera='faults = ["stall@1"]') as service, service.client() as client:
            client.request("scan", timeout_ms=600000)
            with service.client() as other:
                wait_until(lambda: other.call("status")[0]["cameras"][0]["state"] == "capturing", "the camera")
            time.sleep(0.2)
            status, seconds = service.stop()
            self.assertEqual(status, 0)
            self.assertLess(seconds, 300)  # of the 600 that the scan would wait
            with self.assertRaises(RpcError) as caught:
                client.reply()
            self.assertEqual(caught.exception.name, "cancelled")
            self.assertFalse(service.socket.exists())

    def test_sigterm_while_clouds_flow(self):
        with Service() as service, service.client() as client:
            client.call("subscribe")
            client.receive()
            status, _ = service.stop(signal.SIGINT)
            self.assertEqual(status, 0)

    def test_sigterm_lets_what_is_being_sent_arrive(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            client.request("scan", frames="raw", texture=False)
            client.more()  # of more than the socket holds
            service.send_signal(signal.SIGTERM)
            wait_until(lambda: "stopping" in service.log_text(), "the signal")
            time.sleep(0.2)  # a reader that is busy
            result, cloud = client.reply()
            self.assertEqual(len(cloud), result["bytes"])
            frame, image = client.events[0]
            self.assertEqual(len(image), frame["params"]["bytes"])
            self.assertGreater(len(image), 500_000)
            self.assertEqual(service.process.wait(600), 0)

    def test_sigterm_while_a_client_reads_nothing(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            client.request("scan", frames="raw")
            client.more()
            status, seconds = service.stop()
            self.assertEqual(status, 0)
            self.assertLess(seconds, 20)  # of the 30 of send_timeout_ms

    def test_sigterm_while_clients_never_stop_asking(self):
        request = b'{"jsonrpc":"2.0","id":1,"method":"status"}\n' * 16

        def ask(client):
            with contextlib.suppress(OSError):
                while True:
                    client.send(request)
                    client.more()
                    client.buffer = b""
        with Service() as service:
            clients = [service.client() for _ in range(4)]
            threads = [threading.Thread(target=ask, args=[client]) for client in clients]
            for thread in threads:
                thread.start()
            time.sleep(0.5)
            status, _ = service.stop()
            for thread, client in zip(threads, clients):
                thread.join()
                client.close()
            self.assertEqual(status, 0)

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
            self.assertIn(f"{service.socket}: another service runs here", second.stderr)
            with service.client() as client:
                self.assertIn("version", client.call("status")[0])

    def test_second_service_leaves_the_devices_of_the_first_alone(self):
        with Service() as service, tempfile.TemporaryDirectory() as folder:
            other = pathlib.Path(folder) / "other.toml"
            other.write_text(f"""
[[camera]]
name = "camera"
driver = "file"
path = "{folder}/nowhere"
[server]
socket = "{service.socket}"
""", encoding="utf-8")
            second = slsd("--config", other)
            self.assertEqual(second.returncode, 1)
            self.assertIn("another service runs here", second.stderr)
            self.assertNotIn("nowhere", second.stderr)

    def test_path_that_is_no_socket_is_left_alone(self):
        service = Service()
        service.socket.write_text("precious", encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertEqual(result.returncode, 78)
        self.assertIn("is not a socket", result.stderr)
        self.assertEqual(service.socket.read_text(encoding="utf-8"), "precious")

    def test_path_too_long_is_refused(self):
        service = Service()
        service.file.write_text('[server]\nsocket = "/' + "x" * 107 + '"\n', encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertEqual(result.returncode, 78)
        self.assertIn("slsd.toml:2:10: [server] socket must be a path of 1 to 107 bytes", result.stderr)

    def test_a_group_that_is_missing_may_come_later(self):
        service = Service()
        service.file.write_text('[server]\nscan = ["@nobody-made-this"]\n', encoding="utf-8")
        result = slsd("--config", service.file)
        self.assertIn('the group "nobody-made-this", which does not exist on this host', result.stderr)
        self.assertEqual(result.returncode, 1)  # the unit tries it again

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
            changed = text.replace("timeout_ms = 600000", "timeout_ms = 4000\nprojector_latency_ms = 50.0")
            service.file.write_text(changed + "clients_max = 7\n[decode]\ndepth_max_mm = 600.0\n", encoding="utf-8")
            self.assertEqual(client.call("reload")[0], {"needs_restart": ["server", "scan"]})
            self.assertEqual(client.call("scan")[0]["points"], 0)

    def test_reload_of_a_relative_file_finds_nothing_changed(self):
        service = Service()
        (service.folder / "frames").symlink_to(SCENE)
        text = service.file.read_text(encoding="utf-8").replace(f"{SCENE}/", "frames/")
        service.file.write_text(text, encoding="utf-8")
        with open(service.log, "ab") as log:
            service.process = subprocess.Popen([BIN / "slsd", "--config", "slsd.toml"], cwd=service.folder, stderr=log)
        wait_until(lambda: service.socket.exists() or service.process.poll() is not None, "the socket")
        try:
            with service.client() as client:
                self.assertEqual(client.call("reload")[0], {"needs_restart": []})
        finally:
            service.stop()

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
                manager.settimeout(600)
                service = Service(environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "300000"})
                service.launch()
                messages = []

                def await_message(part):
                    while not messages or part not in messages[-1]:
                        messages.append(manager.recv(4096).decode())
                try:
                    await_message("EXTEND_TIMEOUT_USEC=")
                    self.assertGreater(int(messages[-1].split("EXTEND_TIMEOUT_USEC=")[1].split()[0]), 60_000_000)
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

    def test_manager_hears_of_no_reload_that_ends_during_the_stop(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "notify")
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
                manager.bind(path)
                manager.settimeout(600)
                service = Service(environment={"NOTIFY_SOCKET": path})
                with service:
                    service.wait_ready()
                    # Another pattern takes the service a while: it computes the codebook and the decoders again.
                    text = service.file.read_text(encoding="utf-8")
                    service.file.write_text(text.replace(f'file = "{SCENE}/pattern.toml"', "symbol_size_px = 8"), encoding="utf-8")
                    service.send_signal(signal.SIGHUP)
                    while "RELOADING=1" not in manager.recv(4096).decode():
                        pass
                    self.assertEqual(service.stop()[0], 0)
                while "STOPPING=1" not in manager.recv(4096).decode():
                    pass
                manager.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    self.fail(manager.recv(4096).decode())

    def test_manager_is_told_why_nothing_starts(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "notify")
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
                manager.bind(path)
                manager.settimeout(600)
                service = Service(configuration='"a\\nREADY=1" = 1\n', environment={"NOTIFY_SOCKET": path})
                service.launch()
                self.assertEqual(service.process.wait(600), 78)
                told = manager.recv(4096).decode()
                self.assertIn("STATUS=does not start: ", told)
                self.assertIn("no such table or key: a\\nREADY=1", told)
                self.assertNotIn("\n", told.strip())

    @unittest.skipIf(os.environ.get("SLSD_SANITIZE"), "sanitizers need address space without limit")
    def test_memory_that_runs_out_fails_the_request_alone(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            symbols = client.call("scan")[0]["points"]
            status = pathlib.Path(f"/proc/{service.process.pid}/status").read_text(encoding="utf-8")
            used = int(re.search(r"VmSize:\s+(\d+) kB", status)[1]) * 1024
            resource.prlimit(service.process.pid, resource.RLIMIT_AS, (used + (16 << 20), resource.RLIM_INFINITY))
            with self.assertRaises(RpcError) as caught:
                client.call("scan", density="pixels")
            self.assertEqual(caught.exception.name, "no_space")
            self.assertIn("no memory is left", str(caught.exception))
            self.assertEqual(client.call("scan")[0]["points"], symbols)
            resource.prlimit(service.process.pid, resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            self.assertGreater(client.call("scan", density="pixels")[0]["points"], 100 * symbols)

    @unittest.skipIf(os.environ.get("SLSD_SANITIZE"), "sanitizers need address space without limit")
    def test_start_without_enough_memory_says_so(self):
        for mib in (180, 210, 240, 270):
            service = Service(preexec=lambda mib=mib: resource.setrlimit(resource.RLIMIT_AS, (mib << 20, mib << 20)))
            service.launch()
            wait_until(lambda service=service: service.socket.exists() or service.process.poll() is not None, "the start")
            if service.process.poll() is None:
                self.assertEqual(service.stop()[0], 0)
            else:
                self.assertEqual(service.process.returncode, 1, service.log_text())
                self.assertRegex(service.log_text(), "no memory is left: |cannot start a thread ")

    def test_runs_out_of_descriptors_and_recovers(self):
        def few_descriptors():
            resource.setrlimit(resource.RLIMIT_NOFILE, (48, 48))
        with Service(preexec=few_descriptors) as service:
            with service.client() as first:
                first.call("status")
                clients = [Client(service.socket) for _ in range(60)]
                wait_until(lambda: "cannot accept another client" in service.log_text(), "the limit")
                self.assertIn("version", first.call("status")[0])
                for client in clients:
                    client.close()
            with service.client() as client:
                self.assertIn("version", client.call("status")[0])

    def test_lack_of_descriptors_is_named_and_passes(self):
        def few_descriptors():
            resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
        with Service(preexec=few_descriptors) as service, service.client() as first:
            service.wait_ready()
            first.call_for_descriptor("scan", transport="memfd")[1].close()
            clients = [Client(service.socket) for _ in range(80)]
            wait_until(lambda: "cannot accept another client" in service.log_text(), "the limit")
            with self.assertRaises(RpcError) as caught:
                first.call("scan", transport="memfd")
            self.assertEqual(caught.exception.name, "no_space")
            self.assertIn("version", first.call("status")[0])
            try:
                first.call("scan")
            except RpcError as error:  # its camera may need one
                self.assertEqual(error.name, "no_space")
            for client in clients:
                client.close()
            wait_until(lambda: first.call("status")[0]["clients"] == 1, "the clients to be gone")
            result, memory = first.call_for_descriptor("scan", transport="memfd")
            with memory:
                self.assertEqual(len(memory.read()), result["memfd_bytes"])

    def test_clouds_as_memfds_count_until_they_are_closed(self):
        with Service(server="memory_max_mb = 16") as service, service.client() as client:
            service.wait_ready()
            held = []
            with self.assertRaises(RpcError) as caught:
                while len(held) < 300:
                    held.append(client.call_for_descriptor("scan", transport="memfd")[1])
            self.assertEqual(caught.exception.name, "busy")
            self.assertGreater(len(held), 10)
            self.assertGreater(client.call("scan")[0]["points"], 0)
            for memory in held:
                memory.close()
            client.call_for_descriptor("scan", transport="memfd")[1].close()

    def test_memory_that_clients_hold_is_shared(self):
        with Service(server="memory_max_mb = 16\nsend_timeout_ms = 600000") as service:
            service.wait_ready()
            with service.client() as modest:
                greedy = [service.client() for _ in range(24)]
                told = 0
                for client in greedy:  # each holds a frame and a half that it does not read
                    client.request("scan", frames="raw", timeout_ms=600000)
                for client in greedy:
                    message = client.receive_line()
                    told += message.get("error", {}).get("data", {}).get("name") == "busy"
                self.assertGreater(told, 0)
                self.assertLess(told, 24)
                memory = modest.call("status")[0]["clients_memory"]
                self.assertLess(memory["held_bytes"], memory["limit_bytes"] * 1.05)
                self.assertGreater(modest.call("scan", timeout_ms=600000)[0]["points"], 0)
                for client in greedy:
                    client.close()
                wait_until(lambda: modest.call("status")[0]["clients_memory"]["held_bytes"] < 1e6, "the memory")

    @unittest.skipIf(os.environ.get("SLSD_SANITIZE"), "sanitizers keep freed memory")
    def test_memory_stays_level(self):
        with Service() as service, service.client() as client:
            with service.client() as subscriber:  # both lanes decode, each with memory of its own
                subscriber.call("subscribe")
                for _ in range(20):
                    subscriber.receive()
            before = client.call("status")[0]["resident_bytes"]
            for _ in range(150):
                client.call("scan")
            for _ in range(200):
                with service.client() as other:
                    other.send(b"rubbish\n")
            after = client.call("status")[0]["resident_bytes"]
            self.assertLess(after, before * 1.05 + 1e6)

    def test_closed_standard_streams_get_no_other_file(self):
        def close_streams():
            for stream in range(3):
                os.close(stream)
        service = Service()
        service.process = subprocess.Popen([BIN / "slsd", "--config", service.file], preexec_fn=close_streams)
        with contextlib.ExitStack() as end:
            end.callback(service.__exit__)
            wait_until(service.socket.exists, "the socket")
            folder = pathlib.Path(f"/proc/{service.process.pid}/fd")
            self.assertEqual([os.readlink(folder / str(stream)) for stream in range(3)], ["/dev/null"] * 3)
            with service.client() as client:
                client.call("scan")

    def test_starts_without_camera_and_calibration(self):
        with Service(configuration='[server]\nsocket = "slsd.sock"\n') as service, service.client() as client:
            self.assertFalse(client.call("status")[0]["ready"])
            with self.assertRaises(RpcError) as caught:
                client.call("scan")
            self.assertEqual(caught.exception.name, "not_found")
            self.assertTrue(client.call("pattern")[1].startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
