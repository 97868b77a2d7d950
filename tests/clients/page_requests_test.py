#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-web over plain sockets: each way to hide a second request in the first is refused, and ends the connection."""
import socket
import unittest

from page_service import TIMEOUT_S, Web
from service import Service


class Peer:
    """A connection that reads answers one by one."""

    def __init__(self, web):
        self.socket = socket.create_connection(("127.0.0.1", web.port), timeout=TIMEOUT_S)
        self.received = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, data):
        try:
            self.socket.sendall(data)
        except ConnectionError:
            pass

    def more(self):
        try:
            piece = self.socket.recv(65536)
        except ConnectionError:
            piece = b""
        self.received += piece
        return piece != b""

    def answer(self, has_body=True):
        """Status and headers of the next answer; its body is skipped."""
        while b"\r\n\r\n" not in self.received:
            if not self.more():
                return 0, {}
        head, _, self.received = self.received.partition(b"\r\n\r\n")
        first, *lines = head.decode().split("\r\n")
        headers = {name.lower(): value for name, value in (line.split(": ", 1) for line in lines)}
        length = int(headers.get("content-length", 0)) if has_body else 0
        while len(self.received) < length:
            if not self.more():
                break
        self.received = self.received[length:]
        return int(first.split()[1]), headers

    def rest(self):
        while self.more():
            pass
        return self.received


class Requests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()
        cls.service.wait_ready()
        cls.web = Web(cls.service)
        cls.host = f"Host: 127.0.0.1:{cls.web.port}\r\n".encode()
        cls.secret = f"Authorization: Bearer {cls.web.token}\r\n".encode()
        # With the right secret: only that it is read as a part of another request keeps it from being obeyed.
        cls.inner = cls.request(b"POST /api/project", b"Content-Length: 19\r\n", b'{"picture":"white"}')

    @classmethod
    def tearDownClass(cls):
        cls.web.__exit__()
        cls.service.__exit__()

    @classmethod
    def request(cls, begin, headers=b"", body=b"", version=b"HTTP/1.1", host=None, secret=None):
        return (begin + b" " + version + b"\r\n" + (cls.host if host is None else host) +
                (cls.secret if secret is None else secret) + headers + b"\r\n" + body)

    def length(self):
        return b"Content-Length: %d\r\n" % len(self.inner)

    def shows(self):
        with self.service.client() as client:
            return client.call("status")[0]["projector"]["shows"]

    def check_is_refused(self, name, data, statuses):
        before = self.shows()
        with Peer(self.web) as peer:
            peer.send(data)
            status, headers = peer.answer(has_body=not data.startswith(b"HEAD"))
            self.assertIn(status, statuses, name)
            self.assertEqual(headers.get("connection"), "close", name)
            peer.send(self.request(b"GET /api/status"))
            self.assertEqual(peer.rest(), b"", f"{name}: the connection goes on")
        self.assertEqual(self.shows(), before, name)

    def test_a_body_that_is_not_read_ends_the_connection(self):
        length, inner, none = self.length(), self.inner, b""
        for name, data, status in (
                ("a long address", self.request(b"POST /" + 9000 * b"a", length, inner), 414),
                ("a long address, no secret", self.request(b"POST /" + 9000 * b"a", length, inner, secret=none), 414),
                ("long headers", self.request(b"POST /api/scan", b"X: " + 20000 * b"a" + b"\r\n" + length, inner), 431),
                ("many headers", self.request(b"POST /api/scan", 3000 * b"X: a\r\n" + length, inner), 431),
                ("too long a body", self.request(b"POST /api/project", b"Content-Length: 99999\r\n", inner), 413),
                ("no secret", self.request(b"POST /api/project", length, inner, secret=none), 401),
                ("another host", self.request(b"POST /api/project", length, inner, host=b"Host: evil.example\r\n"), 403),
                ("another origin", self.request(b"POST /api/project", b"Origin: http://evil.example\r\n" + length, inner), 403),
                ("no such address", self.request(b"POST /nothing", length, inner), 404),
                ("no such address, no secret", self.request(b"POST /nothing", length, inner, secret=none), 404),
                ("a page", self.request(b"POST /", length, inner), 405),
                ("what is only read", self.request(b"POST /api/status", length, inner), 405),
                ("PUT", self.request(b"PUT /api/project", length, inner), 405),
                ("OPTIONS", self.request(b"OPTIONS /api/project", length, inner), 405),
                ("an unknown method", self.request(b"BREW /api/project", length, inner), 405),
                ("an unknown expectation", self.request(b"POST /api/project", b"Expect: more\r\n" + length, inner), 417)):
            with self.subTest(name):
                self.check_is_refused(name, data, (status,))

    def test_what_can_be_read_in_two_ways_is_refused(self):
        length, inner = self.length(), self.inner
        post, get = b"POST /api/nothing", b"GET /api/status"
        chunked = b"Transfer-Encoding: chunked\r\n"
        ways = {
            "GET with a body": self.request(get, length, inner),
            "HEAD with a body": self.request(b"HEAD /", length, inner),
            "two equal lengths": self.request(post, length + length, inner),
            "two lengths": self.request(post, b"Content-Length: 0\r\n" + length, inner),
            "lengths in one header": self.request(post, b"Content-Length: 0, %d\r\n" % len(inner), inner),
            "equal lengths in one header": self.request(post, b"Content-Length: %d, %d\r\n" % (len(inner), len(inner)), inner),
            "a length and chunks": self.request(post, length + chunked, b"0\r\n\r\n" + inner),
            "chunks and a length": self.request(post, chunked + length, b"0\r\n\r\n" + inner),
            "chunks": self.request(post, chunked, b"0\r\n\r\n" + inner),
            "chunks of a GET": self.request(get, chunked, b"0\r\n\r\n" + inner),
            "chunks twice": self.request(post, chunked + chunked, b"0\r\n\r\n" + inner),
            "a bad size of a chunk": self.request(post, chunked, b"0x0\r\n\r\n" + inner),
            "an endless size of a chunk": self.request(post, chunked, b"f" * 17 + b"\r\n" + inner),
            "an unknown encoding": self.request(post, b"Transfer-Encoding: xchunked\r\n" + length, inner),
            "an encoding after chunks": self.request(post, b"Transfer-Encoding: chunked, identity\r\n", b"0\r\n\r\n" + inner),
            "identity": self.request(post, b"Transfer-Encoding: identity\r\n" + length, inner),
            "a hidden encoding": self.request(post, b"Transfer-Encoding:\x0bchunked\r\n" + length, inner),
            "a space before the colon": self.request(post, b"Content-Length : %d\r\n" % len(inner), inner),
            "a tab before the colon": self.request(post, b"Transfer-Encoding\t: chunked\r\n" + length, inner),
            "a folded header": self.request(post, b"X: a\r\n " + length, inner),
            "a header folded by a tab": self.request(post, b"X: a\r\n\t" + length, inner),
            "a folded first header": self.request(post, host=b" " + self.host, headers=length, body=inner),
            "a header without a colon": self.request(post, b"Content-Length\r\n" + length, inner),
            "a header without a name": self.request(post, b": 5\r\n" + length, inner),
            "a name with a space": self.request(post, b"Content Length: 5\r\n" + length, inner),
            "a bare line feed": self.request(post, b"X: a\n" + length, inner),
            "all bare line feeds": self.request(post, length).replace(b"\r\n", b"\n") + inner,
            "a bare carriage return": self.request(post, b"X: a\r" + length, inner),
            "a carriage return before CR LF": self.request(post, b"X: a\r\r\n" + length, inner),
            "NUL in a value": self.request(post, b"X: a\0b\r\n" + length, inner),
            "NUL in a name": self.request(post, b"X\0: a\r\n" + length, inner),
            "NUL in the address": self.request(b"POST /api/no\0thing", length, inner),
            "DEL in a value": self.request(post, b"X: a\x7fb\r\n" + length, inner),
            "no host": self.request(post, length, inner, host=b""),
            "an empty host": self.request(post, length, inner, host=b"Host:\r\n"),
            "two hosts": self.request(post, length, inner, host=self.host + b"Host: evil.example\r\n"),
            "two equal hosts": self.request(post, length, inner, host=self.host + self.host),
            "a list of hosts": self.request(post, length, inner, host=self.host[:-2] + b", evil.example\r\n"),
            "two secrets": self.request(post, self.secret + length, inner),
            "a sign before the length": self.request(post, b"Content-Length: +%d\r\n" % len(inner), inner),
            "a negative length": self.request(post, b"Content-Length: -1\r\n", inner),
            "a hexadecimal length": self.request(post, b"Content-Length: 0x%x\r\n" % len(inner), inner),
            "an endless length": self.request(post, b"Content-Length: 99999999999999999999999\r\n", inner),
            "a length that wraps round": self.request(post, b"Content-Length: %d\r\n" % (2 ** 64 + 5), inner),
            "an empty length": self.request(post, b"Content-Length:\r\n", inner),
            "a whole address": self.request(b"POST http://127.0.0.1/api/project", length, inner),
            "an authority": self.request(b"CONNECT 127.0.0.1:80", length, inner),
            "an asterisk": self.request(b"OPTIONS *", length, inner),
            "a fragment": self.request(b"GET /api/status#a", length, inner),
            "a parameter twice": self.request(b"GET /api/cloud?after=0&after=1", b"", inner),
            "two spaces": self.request(b"POST  /api/project", length, inner),
            "a tab in the first line": self.request(b"POST\t/api/project", length, inner),
            "no version": b"POST /api/project\r\n" + self.host + length + b"\r\n" + inner,
            "HTTP/0.9": self.request(post, length, inner, version=b"HTTP/0.9"),
            "HTTP/1.2": self.request(post, length, inner, version=b"HTTP/1.2"),
            "HTTP/2": self.request(post, length, inner, version=b"HTTP/2.0"),
            "another protocol": self.request(post, length, inner, version=b"ICE/1.0"),
            "a version in small letters": self.request(post, length, inner, version=b"http/1.1"),
            "an empty line before": b"\r\n" + self.request(post, length, inner),
            "HTTP/2 with prior knowledge": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + inner,
            "TLS": b"\x16\x03\x01\x02\x00\x01" + inner}
        for name, data in ways.items():
            with self.subTest(name):
                self.check_is_refused(name, data, (400,))

    def test_requests_follow_one_another_on_a_connection(self):
        body = b'{"picture":"pattern"}'
        project = self.request(b"POST /api/project", b"Content-Length: %d\r\n" % len(body), body)
        wrong = self.request(b"POST /api/scan", b"Content-Length: 1\r\n", b"{")
        with Peer(self.web) as peer:  # all in one go, each with its own answer
            peer.send(self.request(b"GET /api/status") + project + self.request(b"GET /nothing") + wrong +
                      self.request(b"GET /api/status"))
            self.assertEqual([peer.answer()[0] for _ in range(5)], [200, 200, 404, 400, 200])
            for letter in self.request(b"GET /api/status"):  # byte by byte
                peer.send(bytes([letter]))
            self.assertEqual(peer.answer()[0], 200)
            peer.send(self.request(b"HEAD /page.js"))
            status, headers = peer.answer(has_body=False)
            self.assertEqual((status, int(headers["content-length"]) > 1000), (200, True))
            peer.send(self.request(b"GET /api/status", b"Connection: close\r\n"))
            self.assertEqual((peer.answer()[0], peer.rest()), (200, b""))
        with Peer(self.web) as peer:  # as nginx asks, unless told otherwise
            peer.send(self.request(b"GET /api/status", version=b"HTTP/1.0"))
            self.assertEqual((peer.answer()[0], peer.rest()), (200, b""))

    def test_a_body_is_asked_for_only_of_those_who_are_let_in(self):
        headers = b"Expect: 100-continue\r\nContent-Length: 18\r\n"
        with Peer(self.web) as peer:
            peer.send(self.request(b"POST /api/project", headers))
            self.assertEqual(peer.answer(has_body=False)[0], 100)
            peer.send(b'{"picture":"grid"}')
            self.assertEqual(peer.answer()[0], 200)
        self.check_is_refused("no secret", self.request(b"POST /api/project", headers, secret=b""), (401,))

    def test_no_answer_lets_another_page_frame_or_read_it(self):
        for data in (self.request(b"GET /"), self.request(b"GET /api/status"), self.request(b"GET /nothing"),
                     self.request(b"GET /api/status", b"X: a\n"), self.request(b"GET /api/status", secret=b"")):
            with Peer(self.web) as peer:
                peer.send(data)
                _, headers = peer.answer()
                self.assertIn("frame-ancestors 'none'", headers["content-security-policy"])
                self.assertEqual(headers["x-frame-options"], "DENY")
                self.assertEqual(headers["cross-origin-resource-policy"], "same-origin")
                self.assertEqual([name for name in headers if name.startswith("access-control")], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
