# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Requests and their answers. Each process has one connection."""
from __future__ import annotations

import mmap
import threading
import time
from dataclasses import dataclass
from typing import Any, Generator, Optional, Tuple, Union

from .connection import Connection, Process, clouds_held, this_process
from .errors import Busy, ProtocolError, ScannerError, error_of

GRACE_S = 5.0  # in addition to the timeout that the service itself keeps

Body = Optional[Union[bytearray, mmap.mmap]]
Message = dict[str, Any]
Event = Tuple[Message, Body]


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of a request, the bytes that came with it, and the events before it."""

    result: dict[str, Any]
    body: Body
    events: list[Event]


class _Own:
    """The lock and the connection of one process. A thread of the parent may hold the parent's lock."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.connection: Connection | None = None

    def hang_up(self) -> None:
        connection, self.connection = self.connection, None
        if connection is not None:
            connection.close()


class Channel:
    """Sends requests one after the other. Threads and processes may share it: each process connects by itself."""

    def __init__(self, path: str):
        self.path = path
        self._of: dict[Process, _Own] = {}

    def connect(self) -> None:
        own = self._own()
        with own.lock:
            own.connection = own.connection or Connection(self.path)

    def close(self) -> None:
        self._own().hang_up()

    def call(self, method: str, params: dict[str, Any], timeout_s: float) -> Answer:
        own = self._own()
        with own.lock:
            connection = own.connection = own.connection or Connection(self.path)
            try:
                message, body, events = _answer(connection, method, params, time.monotonic() + timeout_s + GRACE_S)
            except BaseException:
                own.hang_up()  # else a late answer would pass for that of the next request
                raise
        if "error" in message:
            raise _explained(error_of(message["error"]), params)
        return Answer(message["result"], body, events)

    def _own(self) -> _Own:
        process = this_process()
        if process not in self._of:
            self._of.setdefault(process, _Own())
            for other in [known for known in list(self._of) if known != process]:
                inherited = self._of.pop(other, None)
                if inherited is not None:
                    inherited.hang_up()
        return self._of[process]


def subscribed(path: str, params: dict[str, Any], idle_s: float | None) -> Generator[Event, None, None]:
    """Events of a subscription over its own connection. A forked child that goes on reading gets another one."""
    connection = Connection(path)
    try:
        ident = connection.send("subscribe", params)
        answered = False
        while True:
            if not connection.is_own:
                connection.close()
                connection = Connection(path)
                ident = connection.send("subscribe", params)
                answered = False
            wait_s = idle_s if idle_s is not None else None if answered else 2 * GRACE_S
            message, body = connection.receive(None if wait_s is None else time.monotonic() + wait_s)
            if "method" in message:
                yield message, body
            elif "error" in message:
                raise _explained(error_of(message["error"]), params)
            elif message.get("id") == ident:
                answered = True
    finally:
        connection.close()


def _answer(connection: Connection, method: str, params: dict[str, Any], deadline: float
            ) -> tuple[Message, Body, list[Event]]:
    ident = connection.send(method, params)
    events: list[Event] = []
    while True:
        message, body = connection.receive(deadline)
        if "method" in message:
            events.append((message, body))
        elif "error" in message or (message.get("id") == ident and isinstance(message.get("result"), dict)):
            return message, body, events
        else:
            raise ProtocolError(f"the message is not an answer to {method}")


def _explained(error: ScannerError, params: dict[str, Any]) -> ScannerError:
    """Adds to a `Busy` error how this program can release shared memory, if it holds any."""
    held = clouds_held()
    if not isinstance(error, Busy) or params.get("transport") != "memfd" or held == 0:
        return error
    return Busy(f"{error}. This program still holds {held} cloud{'s' if held > 1 else ''} in shared memory: release "
                "one (`del cloud`, and every array that is a view of its points), or scan with shared=False, which "
                "copies the points", error.name, error.where)
