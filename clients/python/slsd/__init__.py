# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""3D scans from slsd as numpy arrays.

    import slsd

    points = slsd.Scanner().scan().points        # a structured array: points["x"], points["sigma_mm"], ...
"""
from .cloud import Cloud, read_ply
from .errors import (Busy, Cancelled, ConnectionLost, DeviceError, FrameError, InvalidRequest, NotFound,
                     PermissionDenied, ProtocolError, ScannerError, TimedOut)
from .model import Mesh, Model
from .options import CalibrationSettings, CameraSettings, CloudSettings, DecodeSettings, PatternSettings
from .scanner import DEFAULT_SOCKET, Exposure, Frame, Scanner

__all__ = [
    "Busy", "CalibrationSettings", "CameraSettings", "Cancelled", "Cloud", "CloudSettings", "ConnectionLost",
    "DEFAULT_SOCKET", "DecodeSettings", "DeviceError", "Exposure", "Frame", "FrameError", "InvalidRequest", "Mesh", "Model", "NotFound",
    "PatternSettings",
    "PermissionDenied", "ProtocolError", "Scanner", "ScannerError", "TimedOut", "read_ply",
]
