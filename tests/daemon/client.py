# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A client of slsd's socket that shares no code with slsd: the standard library, a socket and JSON."""
import array
import json
import os
import socket


class RpcError(Exception):
    def __init__(self, error):
        super().__init__(error["message"])
        self.code = error["code"]
        self.name = error["data"]["name"]


class Client:
    def __init__(self, path, timeout=600):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(timeout)
        self.socket.connect(str(path))
        self.buffer = b""
        self.last_id = 0
        self.events = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def more(self):
        chunk = self.socket.recv(65536)
        if not chunk:
            raise ConnectionError("the daemon hung up")
        self.buffer += chunk

    def receive_line(self):
        """One message; the bytes that follow it are not read."""
        while b"\n" not in self.buffer:
            self.more()
        line, self.buffer = self.buffer.split(b"\n", 1)
        return json.loads(line)

    def receive(self):
        """One message and the bytes that follow it."""
        message = self.receive_line()
        size = (message.get("result") or message.get("params") or {}).get("bytes", 0)
        payload, self.buffer = self.buffer[:size], self.buffer[size:]
        return message, payload + self.receive_bytes(size - len(payload))

    def receive_bytes(self, size):
        """In place: to append each piece to the others would copy a cloud of pixels hundreds of times."""
        payload = bytearray(size)
        rest = memoryview(payload)
        while rest:
            count = self.socket.recv_into(rest)
            if not count:
                raise ConnectionError("the daemon hung up")
            rest = rest[count:]
        return payload

    def request(self, method, **params):
        self.last_id += 1
        message = {"jsonrpc": "2.0", "id": self.last_id, "method": method, "params": params}
        self.send(json.dumps(message).encode() + b"\n")

    def reply(self):
        """The reply to the last request; events before it are kept."""
        while True:
            message, payload = self.receive()
            if "method" in message:
                self.events.append((message, payload))
                continue
            assert message["jsonrpc"] == "2.0"
            if "error" in message:
                raise RpcError(message["error"])
            assert message["id"] == self.last_id
            return message["result"], payload

    def call(self, method, **params):
        self.request(method, **params)
        return self.reply()

    def receive_with_descriptor(self):
        """The next message, and the file that came with it or None. Nothing else may be waiting in the buffer."""
        assert not self.buffer
        line, control, _, _ = self.socket.recvmsg(65536, socket.CMSG_SPACE(array.array("i").itemsize))
        descriptors = array.array("i")
        for level, kind, data in control:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                descriptors.frombytes(data)
        self.buffer += line
        return self.receive_line(), os.fdopen(descriptors[0], "rb") if descriptors else None

    def call_for_descriptor(self, method, **params):
        """A call whose reply comes with one descriptor."""
        self.request(method, **params)
        line, control, _, _ = self.socket.recvmsg(65536, socket.CMSG_SPACE(array.array("i").itemsize))
        descriptors = array.array("i")
        for level, kind, data in control:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                descriptors.frombytes(data)
        self.buffer += line
        result, _ = self.reply()
        return result, os.fdopen(descriptors[0], "rb")
