#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service against clients that send rubbish, too much, too slowly or nothing."""
import json
import random
import re
import unicodedata
import unittest

from client import RpcError
from hostile_client import FLOODS, NASTY, line
from service import Service, wait_until

LOG_LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (debug|info|warning|error|critical) ")
# Every text that a client can send: the parameters of every method that takes some.
TEXTS = {"scan": ["format", "transport", "camera", "frames", "preset", "box", "plane", "box_frame"], "preview": ["camera"], "frame": ["format", "camera"],
         "pattern": ["format"], "project": ["picture", "png"], "subscribe": ["format"], "status": [], "settings": [],
         "reload": [], "preset": ["action", "name"], "presets": ["name"], "set": ["decode", "camera", "pattern", "calibration", "cloud"],
         "calibrate": ["action", "code"], "unsubscribe": []}


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

    def assert_printable(self, text, where):
        odd = [character for character in text if unicodedata.category(character) in ("Cc", "Cf", "Zl", "Zp", "Cs")]
        self.assertEqual(odd, [], where)

    def test_foreign_text_is_cut_and_shown_as_what_it_is(self):
        with self.service.client() as client:
            for method, names in TEXTS.items():
                requests = [{name: text} for name in names for text in NASTY]
                requests += [{text: 1} for text in NASTY]  # a parameter of such a name
                for params in requests:
                    client.request(method, **params)
                    with self.assertRaises(RpcError) as caught:
                        client.reply()
                    self.assert_printable(str(caught.exception), method)
                    self.assertLess(len(str(caught.exception).encode()), 2000)
            for text in NASTY:
                with self.assertRaises(RpcError) as caught:
                    client.call(text)
                self.assert_printable(str(caught.exception), "method")
                client.send(line("status", identity=text))
                client.receive()
            status = json.dumps(client.call("status")[0], ensure_ascii=False)
            self.assertLess(len(status.encode()), 20_000)
            self.assert_printable(status, "status")
        log = self.service.log_text().split("\n")[:-1]
        self.assertEqual([entry for entry in log if not LOG_LINE.match(entry)], [])
        self.assertLess(max(len(entry.encode()) for entry in log), 2048)
        self.assertTrue(any("kernel panic" in entry for entry in log), "it was to be logged at all")

    # How quickly is hostile_soak.py's to say: a machine that runs tests side by side says nothing about it.
    def test_floods_hold_nobody_up(self):
        for kind, flood in FLOODS.items():
            with self.subTest(kind):
                clients = [self.service.client() for _ in range(16)]
                for client in clients:
                    client.socket.setblocking(False)
                with self.service.client() as other:
                    for _ in range(10):
                        for client in clients:
                            try:
                                client.socket.send(flood)
                                client.socket.recv(1 << 20)
                            except OSError:
                                pass
                        self.assertIn("version", other.call("status")[0])
                    for client in clients:
                        client.close()
                    wait_until(lambda: other.call("status")[0]["clients"] == 1, "the others to be gone")

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


if __name__ == "__main__":
    unittest.main(verbosity=2)
