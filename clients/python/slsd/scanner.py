# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A scanner, as slsd serves it."""
from __future__ import annotations

import base64
import mmap
import os
import threading
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Iterator

import numpy as np

from .cloud import Cloud, read_ply
from .connection import Connection
from .errors import ProtocolError, error_of

DEFAULT_SOCKET = "/run/slsd/slsd.sock"
_GRACE_S = 5.0  # beyond the timeout that the service keeps by itself


@dataclass(frozen=True)
class Frame:
    """What a camera saw: height x width, uint8 or uint16; and what the service says of it."""

    image: np.ndarray
    description: dict[str, Any]


class Scanner:
    """A connection to slsd. Requests are answered one after the other; threads may share it.

    Where the connection breaks the request that waits raises ConnectionLost, and the next one connects anew.

    path  its socket; SLSD_SOCKET in the environment, or the usual place
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self._path = path or os.environ.get("SLSD_SOCKET", DEFAULT_SOCKET)
        self._connection: Connection | None = Connection(self._path)
        self._lock = threading.Lock()

    def __enter__(self) -> Scanner:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Hangs up. The service gives up what was waited for."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def scan(self, *, timeout_s: float = 5.0, texture: bool = False, ambient: bool = False, picture: bool = False,
             frames: bool = False, **more: Any) -> Cloud:
        """Takes one scan. The points lie in memory that is shared with the service: nothing is copied.

        texture  the intensity of each point, by a second frame under white light
        ambient  less the light of the room, by a third
        picture  the frame with what was decoded drawn in, as PNG, in `picture`
        frames   the frames themselves, in `frames`
        more     other parameters of the protocol's `scan`, by their names
        """
        params = {"format": "ply", "transport": "memfd", "timeout_ms": _milliseconds(timeout_s), **more}
        params |= {key: True for key, value in (("texture", texture), ("ambient", ambient), ("picture", picture))
                   if value}
        if frames:
            params["frames"] = "raw"
        result, body, events = self._call("scan", params, timeout_s)
        cloud = read_ply(_need(body, "the cloud"), result)
        for event, data in events:
            if event["method"] == "picture":
                cloud.picture = bytes(_need(data, "the picture"))
            elif event["method"] == "frame":
                cloud.frames.append(_frame(event["params"], _need(data, "the frame")))
        return cloud

    def stream(self, *, rate_hz: float | None = None, idle_s: float | None = None, **more: Any) -> Iterator[Cloud]:
        """Clouds as they come, the newest first: what this reader was too slow for is counted in `lost`.

        Runs over a connection of its own until the iterator is closed. A scan that failed is raised where the service
        gives up; those that it repeats are passed over.

        idle_s  raise TimedOut where no cloud came for so long; None waits for ever
        """
        params = {"format": "ply", **more}
        if rate_hz is not None:
            params["rate_hz"] = rate_hz
        connection = Connection(self._path)
        try:
            ident = connection.send("subscribe", params)
            answered = False
            while True:
                deadline = None if idle_s is None and answered else time.monotonic() + (idle_s or 2 * _GRACE_S)
                message, body = connection.receive(deadline)
                if message.get("method") == "cloud":
                    yield read_ply(_need(body, "the cloud"), message["params"])
                elif "method" not in message and message.get("id") == ident:
                    if "error" in message:
                        raise error_of(message["error"])
                    answered = True
        finally:
            connection.close()

    def frame(self, camera: str | None = None, *, as_shown: bool = False, timeout_s: float = 5.0) -> Frame:
        """A camera's frame, under the pattern; with `as_shown` under what the projector shows by now."""
        params: dict[str, Any] = {"format": "raw", "timeout_ms": _milliseconds(timeout_s), "as_shown": as_shown}
        if camera is not None:
            params["camera"] = camera
        result, body, _ = self._call("frame", params, timeout_s)
        return _frame(result, _need(body, "the frame"))

    def preview(self, camera: str | None = None, *, timeout_s: float = 5.0) -> bytes:
        """A frame with what was decoded drawn in, as PNG."""
        params: dict[str, Any] = {"timeout_ms": _milliseconds(timeout_s)}
        if camera is not None:
            params["camera"] = camera
        return bytes(_need(self._call("preview", params, timeout_s)[1], "the picture"))

    def project(self, picture: str, png: bytes | None = None, *, timeout_s: float = 5.0) -> None:
        """Shows "pattern", "idle", "black", "white", "focus", "grid", or an "image" of the projector's size.

        Returns when it is visible.
        """
        params: dict[str, Any] = {"picture": picture, "timeout_ms": _milliseconds(timeout_s)}
        if png is not None:
            params["png"] = base64.b64encode(png).decode()
        self._call("project", params, timeout_s)

    def pattern(self) -> bytes:
        """The pattern's image, as PNG."""
        return bytes(_need(self._call("pattern", {}, _GRACE_S)[1], "the pattern"))

    def status(self) -> dict[str, Any]:
        """The service, its devices, and what all scans came to."""
        return self._call("status", {}, _GRACE_S)[0]

    def settings(self) -> dict[str, Any]:
        """What clouds depend on: pattern, calibration, projector, cameras, configuration."""
        return self._call("settings", {}, _GRACE_S)[0]

    @property
    def role(self) -> str:
        """What this user may: "observe", "scan" (that too) or "administer" (everything)."""
        role = self.status().get("role")
        if not isinstance(role, str):
            raise ProtocolError("the service tells no role: it is older than this package")
        return role

    def reload(self) -> list[str]:
        """Reads the configuration anew. Returns the tables that need a restart."""
        return list(self._call("reload", {}, 60.0)[0].get("needs_restart", []))

    def _call(self, method: str, params: dict[str, Any], timeout_s: float
              ) -> tuple[dict[str, Any], bytearray | mmap.mmap | None,
                         list[tuple[dict[str, Any], bytearray | mmap.mmap | None]]]:
        with self._lock:
            connection = self._connection = self._connection or Connection(self._path)
            try:
                answer = _answer(connection, method, params, time.monotonic() + timeout_s + _GRACE_S)
            except BaseException:
                self.close()  # what comes later would be taken for the answer to the next request
                raise
        if "error" in answer.message:
            raise error_of(answer.message["error"])
        return answer.message["result"], answer.body, answer.events


@dataclass(frozen=True)
class _Answer:
    message: dict[str, Any]
    body: bytearray | mmap.mmap | None
    events: list[tuple[dict[str, Any], bytearray | mmap.mmap | None]]


def _answer(connection: Connection, method: str, params: dict[str, Any], deadline: float) -> _Answer:
    ident = connection.send(method, params)
    events = []
    while True:
        message, body = connection.receive(deadline)
        if "method" in message:
            events.append((message, body))
        elif "error" in message or (message.get("id") == ident and isinstance(message.get("result"), dict)):
            return _Answer(message, body, events)
        else:
            raise ProtocolError(f"what came is no answer to {method}")


def _milliseconds(seconds: float) -> int:
    return max(1, round(1000 * seconds))


def _need(body: bytearray | mmap.mmap | None, what: str) -> bytearray | mmap.mmap:
    if body is None:
        raise ProtocolError(f"{what} did not come with the answer")
    return body


def _frame(description: dict[str, Any], body: bytearray | mmap.mmap) -> Frame:
    try:
        width, height, bits = (int(description[key]) for key in ("width_px", "height_px", "bits"))
    except (KeyError, TypeError, ValueError) as error:
        raise ProtocolError("a frame came without its size") from error
    kind = np.dtype("<u2" if bits > 8 else "u1")
    if width <= 0 or height <= 0 or width * height * kind.itemsize != len(body):
        raise ProtocolError(f"a frame of {width}x{height} px came with {len(body)} bytes")
    return Frame(np.frombuffer(body, kind).reshape(height, width), dict(description))
