#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-tcp: who is served, what each refusal says, that clouds are those of the socket, and that nobody disturbs others."""
import json
import os
import pathlib
import random
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest

from tcp_service import TOKEN, RpcError, Tcp
from service import BIN, TIMEOUT_S, Service, wait_until

LINGER_RESET = struct.pack("ii", 1, 0)


def greeting(token=TOKEN, **members):
    return json.dumps({"jsonrpc": "2.0", "id": 1, "method": "authenticate", "params": {"token": token}, **members}).encode() + b"\n"


def one_error(answer):
    """The only line of an answer: the error's name and message."""
    line, = answer.splitlines()
    error = json.loads(line)["error"]
    return error["data"]["name"], error["message"]


def place_of(ply):
    """The points of a cloud, without the header that names the scan."""
    return bytes(ply[ply.index(b"end_header\n"):])


def greeted(tcp):
    """What a client gets that sends its token and nothing else."""
    with tcp.connect() as connection:
        connection.sendall(greeting())
        connection.shutdown(socket.SHUT_WR)
        return connection.makefile("rb").read()


class Serves(unittest.TestCase):
    def test_the_clouds_of_the_socket(self):
        with Service() as service, Tcp(service.socket) as tcp, service.client() as local, tcp.client() as client:
            for params in ({}, {"format": "pcd"}, {"density": "pixels"}):
                there, _ = local.call("scan", **params)
                here, cloud = client.call("scan", **params)
                self.assertEqual((here["points"], here["bytes"]), (there["points"], len(cloud)))
            self.assertEqual(place_of(client.call("scan")[1]), place_of(local.call("scan")[1]))

    def test_memfds_inline(self):
        with Service() as service, Tcp(service.socket) as tcp, tcp.client() as client:
            expected = place_of(client.call("scan")[1])
            for line in (b'{"jsonrpc":"2.0","id":7,"method":"scan","params":{"transport":"memfd","timeout_ms":5e3}}\n',
                         b'{"jsonrpc":"2.0","id":7,"method":"scan","params":{"transport":"mem\\u0066d"}}\n'):
                client.last_id = 7
                client.send(line)
                result, cloud = client.reply()
                self.assertNotIn("memfd_bytes", result)
                self.assertEqual(place_of(cloud), expected)
            client.call("subscribe", transport="memfd", rate_hz=20)
            for _ in range(3):
                event, cloud = client.receive()
                self.assertEqual((event["method"], place_of(cloud)), ("cloud", expected))

    def test_pictures_and_other_answers_unchanged(self):
        with Service() as service, Tcp(service.socket) as tcp, tcp.client() as client:
            self.assertEqual(client.call("status")[0]["role"], "administer")  # that of the user who runs slsd-tcp
            self.assertTrue(client.call("frame")[1].startswith(b"\x89PNG"))
            with self.assertRaises(RpcError) as refused:
                client.call("scna")
            self.assertEqual(refused.exception.name, "method_not_found")
            client.send(b"nonsense\r\n")
            with self.assertRaises(RpcError) as refused:
                client.reply()
            self.assertEqual(refused.exception.name, "parse_error")

    def test_requests_sent_at_once_in_their_order(self):
        with Service() as service, Tcp(service.socket) as tcp:
            silent = json.loads(greeting())
            del silent["id"]
            lines = [json.dumps(silent)] + [json.dumps({"jsonrpc": "2.0", "id": i, "method": "settings"}) for i in range(50)]
            with tcp.connect() as connection:
                connection.sendall("\n".join(lines).encode())  # the last without its end
                connection.shutdown(socket.SHUT_WR)
                answers = connection.makefile("rb").read().splitlines()
            self.assertEqual([json.loads(line)["id"] for line in answers], list(range(50)))

    def test_a_last_line_that_only_the_end_of_the_connection_ends(self):
        with Service() as service, Tcp(service.socket) as tcp:
            def said(data):
                with tcp.connect() as connection:
                    connection.sendall(data)
                    connection.shutdown(socket.SHUT_WR)
                    return connection.makefile("rb").read()
            answer = said(greeting() + b'{"jsonrpc":"2.0","id":2,"method":"scan","params":{"transport":"memfd"}}')
            _, reply, cloud = answer.split(b"\n", 2)
            result = json.loads(reply)["result"]
            self.assertEqual((result["bytes"], cloud[:4]), (len(cloud), b"ply\n"))
            self.assertEqual(json.loads(said(greeting().rstrip(b"\n"))), {"jsonrpc": "2.0", "id": 1, "result": {}})
            self.assertEqual(one_error(said(greeting("guess" * 4).rstrip(b"\n")))[0], "permission_denied")
            self.assertEqual(one_error(said(b"{"))[0], "permission_denied")
            self.assertEqual(said(b""), b"")

    def test_lines_that_come_byte_by_byte(self):
        with Service() as service, Tcp(service.socket) as tcp, tcp.connect() as connection:
            for byte in greeting() + b'{"jsonrpc":"2.0","id":2,"method":"settings"}\n':
                connection.sendall(bytes([byte]))
            answers = connection.makefile("rb")
            self.assertEqual([json.loads(answers.readline())["id"] for _ in range(2)], [1, 2])

    def test_over_ipv6(self):
        if not socket.has_ipv6 or not pathlib.Path("/proc/net/if_inet6").exists():
            self.skipTest("no IPv6 here")
        with Service() as service, Tcp(service.socket, "--listen", "::1") as tcp, tcp.client(address="::1") as client:
            self.assertTrue(client.call("status")[0]["ready"] in (True, False))


class Refuses(unittest.TestCase):
    """Each refusal is one line that says what to do, and nothing reaches the service."""

    def setUp(self):
        self.service = self.enterContext(Service())

    def test_a_wrong_token_and_then_its_address(self):
        with Tcp(self.service.socket) as tcp:
            for _ in range(5):
                name, message = one_error(tcp.say(greeting("guess" * 4)))
                self.assertEqual((name, message), ("permission_denied", "that is not the token of this scanner"))
            for token in ("guess" * 4, TOKEN):
                name, message = one_error(tcp.say(greeting(token)))
                self.assertEqual((name, message), ("busy", "too many wrong tokens from this address: wait half a minute"))

    def test_what_is_no_token(self):
        with Tcp(self.service.socket) as tcp:
            for data in (b"GET / HTTP/1.1\r\nHost: a\r\n\r\n", b"\n", b"{}\n", b'{"jsonrpc":"2.0","id":3,"method":"scan"}\n',
                         b"\x16\x03\x01\x02\x00\x01\n", b"[" * 4000 + b"\n"):
                name, message = one_error(tcp.say(data))
                self.assertEqual(name, "permission_denied", data)
                self.assertIn('"method":"authenticate"', message)
            for params in ({}, {"token": 5}, {"tokne": TOKEN}, {"token": ""}):
                name, _ = one_error(tcp.say(greeting(params=params)))
                self.assertIn(name, ("invalid_params", "permission_denied"), params)

    def test_an_address_that_is_not_named(self):
        with Tcp(self.service.socket, "--listen", "0.0.0.0", "--allow", "127.0.0.7", "--allow", "127.1.0.0/16") as tcp:
            name, message = one_error(tcp.say(b""))
            self.assertEqual(name, "permission_denied")
            self.assertRegex(message, "^127.0.0.1: this address may not connect: start slsd-tcp with --allow")
            for source in ("127.0.0.7", "127.1.2.3"):
                with tcp.client(source=source) as client:
                    client.call("settings")
            name, _ = one_error(tcp.say(greeting(), source="127.2.0.1"))
            self.assertEqual(name, "permission_denied")
            self.assertIn("refused 127.0.0.1: this address may not connect", tcp.log_text())

    def test_more_clients_than_there_are_places(self):
        with Tcp(self.service.socket, "--clients-max", 2) as tcp, tcp.client() as first:
            with tcp.client() as second:
                second.call("settings")
                name, message = one_error(tcp.say(greeting()))
                self.assertEqual((name, message), ("busy", "2 clients are connected: try again later, or raise --clients-max"))
            wait_until(lambda: b'"result"' in greeted(tcp), "a free place")
            first.call("settings")

    def test_lines_without_end(self):
        with Tcp(self.service.socket) as tcp:
            name, message = one_error(tcp.say(b"x" * 5000))
            self.assertEqual((name, message), ("invalid_request", "the first line has at most 4096 bytes; the connection ends"))
            answer = tcp.say(greeting() + b'{"jsonrpc":"2.0","id":2,"method":"' + b"x" * (3 << 20))
            first, last = answer.splitlines()
            self.assertIn("result", json.loads(first))
            self.assertEqual(one_error(last)[0], "invalid_request")
            self.assertIn("a request has at most 1048576 bytes", one_error(last)[1])

    def test_those_who_send_no_token(self):
        with Tcp(self.service.socket) as tcp:
            begin = time.monotonic()
            silent = [tcp.connect() for _ in range(4)]
            try:
                name, message = one_error(tcp.say(b""))
                self.assertEqual(name, "busy")
                self.assertIn("4 connections from this address have sent no token", message)
                with tcp.client(source="127.0.0.2") as client:
                    client.call("settings")
                for connection in silent:
                    self.assertEqual(one_error(connection.makefile("rb").read()), ("timeout", "no token came in time; the connection ends"))
                self.assertLess(time.monotonic() - begin, 30)
                self.assertGreater(time.monotonic() - begin, 4)
            finally:
                for connection in silent:
                    connection.close()

    def test_while_there_is_no_service(self):
        with Tcp("/nonexistent/slsd.sock") as tcp:
            name, message = one_error(tcp.say(greeting()))
            self.assertEqual(name, "not_found")
            self.assertIn("no service answers there: start slsd", message)
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as hung:
            path = str(pathlib.Path(folder, "hung.sock"))
            hung.bind(path)
            hung.listen(0)
            with Tcp(path) as tcp, tcp.client():  # takes the only place of the queue, and is accepted by nobody
                name, message = one_error(tcp.say(greeting()))
                self.assertEqual(name, "busy")
                self.assertIn("the service does not accept connections", message)

    def tearDown(self):
        with self.service.client() as client:
            self.assertEqual(client.call("status")[0]["scans"]["succeeded"], 0)


class Isolates(unittest.TestCase):
    """A client that does not read, vanishes or sends rubbish costs others nothing."""

    def test_clients_that_stall(self):
        with Service() as service, Tcp(service.socket) as tcp, tcp.client() as good, service.client() as local:
            good.call("scan")
            stalled = [tcp.client() for _ in range(3)]
            for client in stalled:
                client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                for _ in range(20):
                    client.request("scan", density="pixels", format="pcd")
            longest = 0
            begin = time.monotonic()
            while time.monotonic() - begin < 5:
                for client in (good, local):
                    at = time.monotonic()
                    client.call("settings")
                    longest = max(longest, time.monotonic() - at)
            self.assertLess(longest, 2)
            self.assertGreater(good.call("scan", timeout_ms=600000)[0]["points"], 1000)
            wait_until(lambda: local.call("status")[0]["clients"] == 2, "the end of those that stalled")
            self.assertEqual(tcp.log_text().count("disconnected"), 3)
            for client in stalled:
                client.close()

    def test_a_client_that_never_reads_its_refusal(self):
        with Service() as service, Tcp(service.socket) as tcp:
            silent = [tcp.connect() for _ in range(200)]
            for connection in silent:
                connection.sendall(b"x" * 100 + b"\n")
            begin = time.monotonic()
            with tcp.client(source="127.0.0.2") as client:
                client.call("settings")
            self.assertLess(time.monotonic() - begin, 60)
            for connection in silent:
                connection.close()

    def test_clients_that_vanish(self):
        with Service() as service, Tcp(service.socket) as tcp, service.client() as local:
            for how in ("reset", "half open", "closed"):
                for _ in range(10):
                    client = tcp.client()
                    client.request("subscribe", rate_hz=50)
                    client.receive()
                    if how == "reset":
                        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, LINGER_RESET)
                    elif how == "half open":
                        client.socket.shutdown(socket.SHUT_WR)
                        client.receive()  # it still gets what it asked for
                    client.close()
                    wait_until(lambda: local.call("status")[0]["clients"] == 1, "the end of one that was " + how)

    def test_a_service_that_restarts(self):
        service = Service().start()
        with Tcp(service.socket) as tcp:
            client = tcp.client()
            client.call("settings")
            service.stop()
            with self.assertRaises(ConnectionError):
                client.call("settings")
            client.close()
            with service, tcp.client() as again:
                again.call("settings")

    def test_rubbish(self):
        numbers = random.Random(7)
        with Service() as service, Tcp(service.socket) as tcp:
            for turn in range(60):
                junk = bytes(numbers.choices(range(256), k=numbers.randrange(1, 3000)))
                if turn % 2:
                    junk = greeting() + junk.replace(b"\n", b"") + b"\n"
                with tcp.connect(source=f"127.0.0.{1 + turn % 2}") as connection:
                    connection.sendall(junk)
                    connection.shutdown(socket.SHUT_WR)
                    for line in connection.makefile("rb").read().splitlines():
                        json.loads(line)
            with tcp.client(source="127.0.0.9") as client:
                client.call("settings")

    def test_memory_stays_small(self):
        with Service() as service, Tcp(service.socket) as tcp, tcp.client() as client:
            for _ in range(5):
                client.call("scan", density="pixels", format="pcd")
            with open(f"/proc/{tcp.process.pid}/status", encoding="ascii") as lines:
                peak_kib = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
            self.assertLess(peak_kib, 32 << 10 if not os.environ.get("SLSD_SANITIZE") else 1 << 20)


class Starts(unittest.TestCase):
    def refused(self, *arguments, token=TOKEN):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "token")
            file.write_text(token, encoding="utf-8")
            port = [] if "--port" in arguments else ["--port", "0"]
            done = subprocess.run([BIN / "slsd-tcp", *port, "--token-file", file, *map(str, arguments)], capture_output=True, text=True,
                                  timeout=TIMEOUT_S, check=False)
            return done.returncode, done.stderr

    def test_only_with_a_token_and_named_addresses(self):
        done = subprocess.run([BIN / "slsd-tcp"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--token-file is missing: a file with the token", done.stderr)
        status, error = self.refused(token="short")
        self.assertEqual(status, 1)
        self.assertIn("a token must have 16 characters or more", error)
        status, error = self.refused("--listen", "0.0.0.0")
        self.assertEqual(status, 1)
        self.assertIn("name the addresses that may connect: --allow", error)
        for wrong in ("robot", "1.2.3", "1.2.3.4/33", "1.2.3.4/", "fd00::/129", "1.2.3.4/x"):
            status, error = self.refused("--allow", wrong)
            self.assertEqual((status, error.count("\n")), (1, 1), (wrong, error))
        status, error = self.refused("--allow", "")
        self.assertEqual(status, 2)
        self.assertIn("--allow: an empty value", error)
        self.assertEqual(self.refused("--listen", "nowhere")[0], 1)
        self.assertIn("choose an address of this machine", self.refused("--listen", "203.0.113.1", "--allow", "203.0.113.2")[1])

    def test_not_at_a_port_in_use(self):
        with Service() as service, Tcp(service.socket) as tcp:
            status, error = self.refused("--port", tcp.port)
            self.assertEqual(status, 1)
            self.assertIn(f"the port is in use by slsd-tcp (process {tcp.process.pid})", error)

    def test_and_ends_by_a_signal_with_clients_connected(self):
        with Service() as service:
            with Tcp(service.socket) as tcp:
                client = tcp.client()
                watcher = threading.Thread(target=lambda: client.socket.recv(1))
                watcher.start()
            watcher.join()
            self.assertEqual(tcp.status, 0)
            client.close()


if __name__ == "__main__":
    unittest.main(verbosity=2)
