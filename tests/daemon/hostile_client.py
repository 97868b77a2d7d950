# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Clients that mean harm: what they send, and a process full of them that come, flood, stall and vanish."""
import array
import errno
import json
import random
import selectors
import socket
import time

MIB = 1 << 20
NASTY = ["x\n<2>kernel panic", "x\r\n<0>forged", "\x1b[2J\x1b]0;owned\x07", "\x00\x01\x7f", "\u0085\u009b31m",
         "\u2028\u2029\u202e", "\ud800", "é" * 300, "%s%n{}", "x" * 900_000, "\n<2>" * 200_000]


def line(method, identity=1, **params):
    message = {"jsonrpc": "2.0", "method": method, "params": params}
    if identity is not None:
        message["id"] = identity
    return json.dumps(message).encode() + b"\n"


def junk(size):
    return random.Random(1).randbytes(size)


# What is sent over and over by a client that floods. Each is some lines, or a part of one without an end.
FLOODS = {
    "feeds": b"\n" * 65536,
    "blanks": b" \t \n" * 16384,
    "spaces": b" " * 65535 + b"\n",
    "braces": b"{" * 65535 + b"\n",
    "short_braces": b"{\n" * 32768,
    "nested": (b'{"a":' * 40 + b"0" + b"}" * 40 + b"\n") * 200,
    "lists": b"[" + b"[]," * (MIB // 3 - 1) + b"0]\n",
    "junk": junk(65536),
    "junk_lines": b"x" * (MIB - 1) + b"\n",
    "open_text": b'"' + b"x" * (MIB - 2) + b"\n",
    "long_name": line("m" * (MIB - 100)),
    "long_parameter": line("status", **{"p" * (MIB - 100): 1}),
    "long_text": line("project", picture="image", png="A" * (MIB - 200)),
    "status": line("status") * 500,
    "notifications": line("status", None) * 500,
    "unknown": line("stattus") * 500,
    "texts": b"".join(line("scan", camera=text) for text in NASTY) + b"".join(line(text) for text in NASTY),
}
BLANK = {"feeds", "blanks", "spaces"}  # lines that no reply is owed to, and that cost a flood nothing
ENDLESS = {"no_end": b"x" * 65536, "no_end_of_braces": b"{" * 65536}


class Hostile:
    """One connection. Drops are what it wants; the service is not to mind."""

    def __init__(self, path, kind, life_s):
        self.kind = kind
        self.end = time.monotonic() + life_s
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(5)
        self.socket.connect(path)
        self.socket.setblocking(False)
        self.lines = 0
        self.at = 0
        self.held = []
        self.watched = False
        self.payload = FLOODS.get(kind) or ENDLESS.get(kind)
        self.reads = self.payload is not None
        if self.payload is None:
            self.strike()

    def strike(self):
        """Asks for something, and goes no further."""
        request = {
            "stall": b'{"jsonrpc":"2.0","id":1,' + b" " * random.randrange(1, 200_000),
            "raw": line("scan", frames="raw", timeout_ms=2000) * 4,
            "subscribe": line("subscribe"),
            "vanish": line("scan", timeout_ms=2000),
            "half": line("scan", timeout_ms=2000)[:-1],
            "memfd": line("scan", transport="memfd", timeout_ms=2000),
            "urgent": line("scan", timeout_ms=2000),
        }[self.kind]
        try:
            self.socket.send(request)
            if self.kind == "half":
                self.socket.shutdown(socket.SHUT_WR)
            if self.kind == "urgent":
                self.socket.send(b"!", socket.MSG_OOB)
        except OSError:
            pass
        self.lines += request.count(b"\n")
        if self.kind == "vanish":
            self.end = time.monotonic() + random.random() * 0.2

    def read(self):
        if self.kind == "memfd":
            data, control, _, _ = self.socket.recvmsg(65536, socket.CMSG_SPACE(4 * 16))
            for _, _, descriptors in control:
                held = array.array("i")
                held.frombytes(descriptors[:len(descriptors) // 4 * 4])
                self.held += held
            return bool(data)
        return bool(self.socket.recv(65536))

    def write(self):
        sent = self.socket.send(memoryview(self.payload)[self.at:self.at + 262144])
        lines = self.payload.count(b"\n", self.at, self.at + sent)
        self.lines += lines
        self.at = (self.at + sent) % len(self.payload)
        return 0 if self.kind in BLANK else lines

    def close(self):
        self.socket.close()
        for number in self.held:
            socket.close(number)


STRIKES = ["stall", "raw", "subscribe", "vanish", "half", "memfd", "urgent"]
SCANNING = {"raw", "vanish", "half", "memfd", "urgent"}


def flooding(share):
    """Whether it floods now, that does so for a share of each minute."""
    return time.monotonic() % 60 < 60 * share


def flood(path, kinds, clients, life_s, share, stop, counts, total):
    """Keeps so many hostile clients until told to stop. counts: the lines by kind of those that are gone.
    total: the lines of all that flood, but the blank ones."""
    chooser = random.Random(2)
    selector = selectors.DefaultSelector()
    alive = []
    while not stop.is_set():
        while len(alive) < clients:
            kind = chooser.choice(kinds)
            # The scanner's queue is for all: those who fill it are another test's.
            if kind in SCANNING and sum(each.kind in SCANNING for each in alive) >= 8:
                continue
            try:
                hostile = Hostile(path, kind, life_s * (0.5 + chooser.random()))
            except OSError as error:
                if error.errno not in (errno.EAGAIN, errno.ECONNRESET, errno.EPIPE):
                    raise
                break
            alive.append(hostile)
            events = (selectors.EVENT_WRITE if hostile.payload else 0) | (
                selectors.EVENT_READ if hostile.reads or hostile.kind in ("memfd", "half") else 0)
            hostile.watched = bool(events)
            if events:
                selector.register(hostile.socket, events, hostile)
        now = time.monotonic()
        gone = {hostile for hostile in alive if now > hostile.end}
        if not flooding(share):
            time.sleep(0.01)
        for key, events in selector.select(0.05) if flooding(share) else []:
            hostile = key.data
            try:
                if events & selectors.EVENT_READ and not hostile.read():
                    gone.add(hostile)
                elif events & selectors.EVENT_WRITE:
                    total.value += hostile.write()
            except BlockingIOError:
                pass
            except OSError:
                gone.add(hostile)
        for hostile in gone:
            if hostile.watched:
                selector.unregister(hostile.socket)
            counts[hostile.kind] = counts.get(hostile.kind, 0) + hostile.lines
            hostile.close()
            alive.remove(hostile)
    for hostile in alive:
        counts[hostile.kind] = counts.get(hostile.kind, 0) + hostile.lines
        hostile.close()
