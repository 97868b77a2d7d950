# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans of slsd as numpy arrays.

    import slsd

    points = slsd.Scanner().scan().points        # a structured array: points["x"], points["sigma_mm"], ...
"""
from .cloud import Cloud, read_ply
from .errors import (Busy, Cancelled, ConnectionLost, DeviceError, FrameError, InvalidRequest, NotFound,
                     PermissionDenied, ProtocolError, ScannerError, TimedOut)
from .scanner import DEFAULT_SOCKET, Frame, Scanner

__all__ = [
    "Busy", "Cancelled", "Cloud", "ConnectionLost", "DEFAULT_SOCKET", "DeviceError", "Frame", "FrameError",
    "InvalidRequest", "NotFound", "PermissionDenied", "ProtocolError", "Scanner", "ScannerError", "TimedOut", "read_ply",
]
