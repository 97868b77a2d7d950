# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Exceptions for the errors of the protocol."""
from __future__ import annotations

from typing import Any, Mapping


class ScannerError(Exception):
    """An error from the service, or of the connection to it.

    name: the protocol's name for it, such as "frame_late"; where: a file's line, a camera, a key, or empty.
    """

    def __init__(self, message: str, name: str = "", where: str = ""):
        super().__init__(message)
        self.name = name
        self.where = where


class InvalidRequest(ScannerError):
    """A parameter is unknown or out of range, or the service does not know the method."""


class NotFound(ScannerError):
    """No such camera or file; no camera or calibration is configured; a replay has ended."""


class PermissionDenied(ScannerError):
    """This user may not do that."""


class Busy(ScannerError):
    """There are too many requests or clients, or too little memory. Ask again later, or for less."""


class TimedOut(ScannerError):
    """A device was not ready in time (`where` names it), or the service did not answer at all."""


class Cancelled(ScannerError):
    """The service is stopping."""


class DeviceError(ScannerError):
    """The camera or the projector is gone, or does not match configuration and calibration."""


class FrameError(ScannerError):
    """A frame was lost, torn, late, stale or skewed, in every attempt that the time allowed."""


class ConnectionLost(ScannerError):
    """No service listens at the socket, or the service closed the connection."""


class ProtocolError(ScannerError):
    """An answer breaks the protocol: another program, or another version, listens at the socket."""


_BY_NAME = {
    "parse_error": InvalidRequest, "invalid_request": InvalidRequest, "method_not_found": InvalidRequest,
    "invalid_params": InvalidRequest, "invalid_argument": InvalidRequest, "not_found": NotFound,
    "permission_denied": PermissionDenied, "busy": Busy, "timeout": TimedOut, "cancelled": Cancelled,
    "disconnected": DeviceError, "mismatch": DeviceError, "io": DeviceError, "frame_dropped": FrameError,
    "frame_torn": FrameError, "frame_stale": FrameError, "frame_late": FrameError, "frame_skewed": FrameError,
}


def error_of(answer: Any) -> ScannerError:
    """Makes the exception for the `error` of a reply."""
    if not isinstance(answer, Mapping):
        return ProtocolError("the service sent an error that is not an object")
    data = answer.get("data")
    data = data if isinstance(data, Mapping) else {}
    name, where = str(data.get("name", "")), str(data.get("where", ""))
    message = str(answer.get("message", "the service gave no reason"))
    return _BY_NAME.get(name, ScannerError)(message, name, where)
