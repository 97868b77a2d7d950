# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A connection to the service: JSON-RPC lines, the bytes after them, and file descriptors."""
from __future__ import annotations

import array
import fcntl
import json
import mmap
import os
import socket
import time
import weakref
from typing import Any

import numpy as np

from .errors import ConnectionLost, InvalidRequest, PermissionDenied, ProtocolError, TimedOut

_LINE_MAX = 1 << 20
_BYTES_MAX = 1 << 32
_SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_WRITE  # a memfd that may still shrink could end this process later

Process = tuple[int, int]
_forks = 0


def this_process() -> Process:
    """Identifies this process among its parents and children. The count of forks tells reused ids apart."""
    return os.getpid(), _forks


class Connection:
    """A connection, which belongs to the process that opened it.

    A forked child shares the parent's socket, and the parent would miss what the child reads. The child therefore closes
    its copy at once, and using it raises ConnectionLost.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path = os.fspath(path)
        self._process = this_process()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._buffer = bytearray()
        self._descriptors: list[int] = []
        self._last_id = 0
        _open.add(self)
        try:
            self._socket.settimeout(5)
            self._socket.connect(self.path)
        except PermissionError as error:
            self.close()
            raise PermissionDenied(f"{self.path}: you may not use this scanner; join the group that owns the socket",
                                   "permission_denied", self.path) from error
        except (BlockingIOError, TimeoutError) as error:  # the queue is full: the service accepts no connections
            self.close()
            raise TimedOut(f"{self.path}: the service does not accept connections; run systemctl restart slsd", "timeout", self.path) from error
        except OSError as error:
            self.close()
            raise ConnectionLost(f"{self.path}: {error.strerror}; check that slsd runs: systemctl status slsd",
                                 where=self.path) from error

    @property
    def is_own(self) -> bool:
        """Whether this process opened the connection."""
        return self._process == this_process()

    def close(self) -> None:
        """Closes the connection. If a forked child calls this, the parent's connection stays open."""
        if self.is_own:
            try:
                self._socket.shutdown(socket.SHUT_RDWR)  # even if a child still holds a copy, or a thread waits
            except OSError:
                pass
        self._socket.close()
        while self._descriptors:
            os.close(self._descriptors.pop())

    def send(self, method: str, params: dict[str, Any]) -> int:
        """Sends a request and returns its id."""
        self._refuse_others()
        self._last_id += 1
        request = {"jsonrpc": "2.0", "id": self._last_id, "method": method, "params": params}
        try:
            line = json.dumps(request, allow_nan=False, default=_plain)
        except (TypeError, ValueError) as error:
            raise InvalidRequest(f"{method}: a parameter is not valid in JSON: {error}", "invalid_params") from error
        try:
            self._socket.settimeout(10)
            self._socket.sendall(line.encode() + b"\n")
        except OSError as error:
            raise self._lost(error) from error
        return self._last_id

    def receive(self, deadline: float | None) -> tuple[dict[str, Any], bytearray | mmap.mmap | None]:
        """Waits for the next message. Returns it with its bytes, or with its memfd mapped for reading.

        deadline: a time of time.monotonic(); None waits for ever.
        """
        self._refuse_others()
        while (end := self._buffer.find(b"\n")) < 0:
            if len(self._buffer) > _LINE_MAX:
                raise ProtocolError("the answer is not a message of slsd: its line exceeds 1 MiB")
            self._more(deadline)
        line = bytes(self._buffer[:end])
        del self._buffer[:end + 1]
        try:
            message = json.loads(line)
        except ValueError as error:
            raise ProtocolError(f"the answer is not JSON: {line[:80]!r}") from error
        if not isinstance(message, dict) or message.get("jsonrpc") != "2.0":
            raise ProtocolError("the answer is not JSON-RPC 2.0")
        body = message.get("params" if "method" in message else "result")
        if not isinstance(body, dict):
            return message, None
        if "memfd_bytes" in body:
            return message, self._map(_size(body["memfd_bytes"]))
        if "bytes" in body:
            return message, self._bytes(_size(body["bytes"]), deadline)
        return message, None

    def _refuse_others(self) -> None:
        if not self.is_own:
            raise ConnectionLost(f"{self.path}: this connection belongs to the parent process; open one in this process",
                                 "disconnected", self.path)

    def _lost(self, error: OSError) -> Exception:
        if isinstance(error, TimeoutError):
            return TimedOut(f"{self.path}: the service does not answer", "timeout", self.path)
        return ConnectionLost(f"{self.path}: the service closed the connection: {error.strerror or error}", where=self.path)

    def _wait(self, deadline: float | None) -> None:
        if deadline is None:
            self._socket.settimeout(None)
            return
        left = deadline - time.monotonic()
        if left <= 0:
            raise TimedOut(f"{self.path}: the service does not answer", "timeout", self.path)
        self._socket.settimeout(left)

    def _more(self, deadline: float | None) -> None:
        space = socket.CMSG_SPACE(4 * array.array("i").itemsize)
        try:
            self._wait(deadline)
            chunk, control, _, _ = self._socket.recvmsg(1 << 16, space, socket.MSG_CMSG_CLOEXEC)
        except OSError as error:
            raise self._lost(error) from error
        for level, kind, data in control:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                received = array.array("i")
                received.frombytes(data[:len(data) - len(data) % received.itemsize])
                self._descriptors.extend(received)
        if not chunk:
            raise ConnectionLost(f"{self.path}: the service closed the connection", where=self.path)
        self._buffer += chunk

    def _bytes(self, size: int, deadline: float | None) -> bytearray:
        data = bytearray(size)
        have = min(size, len(self._buffer))
        data[:have] = self._buffer[:have]
        del self._buffer[:have]
        rest = memoryview(data)[have:]
        while rest:
            try:
                self._wait(deadline)
                count = self._socket.recv_into(rest)
            except OSError as error:
                raise self._lost(error) from error
            if count == 0:
                raise ConnectionLost(f"{self.path}: the service closed the connection in the middle of a cloud", where=self.path)
            rest = rest[count:]
        return data

    def _map(self, size: int) -> mmap.mmap:
        if not self._descriptors:
            raise ProtocolError("the service announced a cloud as a memfd, but sent no descriptor")
        descriptor = self._descriptors.pop(0)
        try:
            if os.fstat(descriptor).st_size != size or size == 0:
                raise ProtocolError("the memfd does not have the announced size")
            if not _sealed(descriptor):
                raise ProtocolError("the memfd is not sealed")
            memory = mmap.mmap(descriptor, size, prot=mmap.PROT_READ)
        finally:
            os.close(descriptor)
        _lent.add(memory)
        return memory


_open: weakref.WeakSet[Connection] = weakref.WeakSet()
_lent: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def clouds_held() -> int:
    """How many clouds this process holds in memory shared with the service."""
    return len(_lent)


def _leave_to_parent() -> None:
    global _forks
    _forks += 1
    for connection in list(_open):
        connection.close()


os.register_at_fork(after_in_child=_leave_to_parent)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} {value!r:.80}")


def _sealed(descriptor: int) -> bool:
    try:
        return fcntl.fcntl(descriptor, fcntl.F_GET_SEALS) & _SEALS == _SEALS
    except OSError:  # no memfd
        return False


def _size(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _BYTES_MAX:
        raise ProtocolError(f"a message announces {value!r} bytes")
    return value
