#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service against clients that send rubbish, too much, too slowly or nothing."""
import random
import unittest

from client import RpcError
from service import Service, wait_until


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


if __name__ == "__main__":
    unittest.main(verbosity=2)
