# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The scanner, as a client of the service slsd."""
from __future__ import annotations

import base64
import os
import pathlib
import secrets
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Callable, Generator, Literal, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from .channel import GRACE_S, Answer, Body, Channel, subscribed
from .cloud import Cloud, read_ply
from .errors import InvalidRequest, NotFound, ProtocolError, ScannerError
from .options import CalibrationSettings, CameraSettings, CloudSettings, Code, DecodeSettings, Density, PatternSettings, Picture

DEFAULT_SOCKET = "/run/slsd/slsd.sock"
_TIMEOUT_MAX_S = 600.0  # of the protocol
_RELOAD_MAX_S = 60.0
_LOOK_EVERY_S = 0.2
_FILES = {".ply": "ply", ".pcd": "pcd", ".tiff": "tiff", ".tif": "tiff"}


@dataclass(frozen=True, eq=False)
class Frame:
    """A camera's image (height x width, uint8 or uint16), and the service's description of it."""

    image: npt.NDArray[Any]
    description: dict[str, Any]


@dataclass(frozen=True)
class Exposure:
    """A camera's configured exposure; None if the configuration leaves a value to the camera."""

    camera: str
    exposure_us: float | None
    gain_db: float | None


class Scanner:
    """A connection to slsd. It answers requests one after the other, and threads may share it.

    After a fork, parent and child have a connection each. A pickled scanner connects in the process that unpickles it.
    If the connection breaks, the pending request raises ConnectionLost, and the next one connects anew.

    path  the service's socket; None: SLSD_SOCKET in the environment, else /run/slsd/slsd.sock

    `timeout_s` of a method limits how long the service waits for devices and frames: 0.001 to 600 seconds. None means
    the time in the service's configuration.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self._channel = Channel(os.fspath(path) if path else os.environ.get("SLSD_SOCKET") or DEFAULT_SOCKET)
        self._channel.connect()

    def __enter__(self) -> Scanner:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self.close()

    def __getstate__(self) -> str:
        return os.path.abspath(self._channel.path)

    def __setstate__(self, path: str) -> None:
        self._channel = Channel(path)

    def close(self) -> None:
        """Closes the connection. The service cancels the pending request."""
        self._channel.close()

    def scan(self, *, timeout_s: float | None = 5.0, density: Density | None = None, normals: bool = False,
             texture: bool = False, colour: bool = False, ambient: bool = False, picture: bool = False,
             camera: str | None = None, frames: bool = False, shared: bool = True, why: bool = False,
             preset: str | None = None, coordinate_frame: Literal["rig", "robot_base"] | None = None,
             robot_pose: Sequence[float] | None = None, poses: str | None = None, box: Sequence[float] | None = None,
             plane: Sequence[float] | None = None, box_frame: Literal["rig", "robot_base"] | None = None,
             voxel_mm: float | None = None, stride: int | None = None) -> Cloud:
        """Takes one scan.

        density  "symbols": a point for each symbol of the pattern; "pixels": one for each camera pixel; None: as
                 configured
        normals  adds the normal of each point; needs pixels
        texture  measures the intensity of each point, with a second frame under white light
        colour   measures its colour as well, with a camera that sees colours
        ambient  subtracts the light of the room, with a third frame
        picture  returns the frame with decoded symbols drawn in, as PNG, in `picture`
        camera   the camera of the picture; None: the first
        frames   returns the frames themselves, in `frames`
        shared   the points lie in memory shared with the service until the cloud is released: nothing is copied. The
                 service lends a few dense clouds at once. False copies
        why      lists the rules that rejected regions, with remedies, in `description["reasons"]`; the picture marks
                 each region by its rule
        preset   applies the settings of this preset, which stay in force, and scans with them
        coordinate_frame  the frame of the points; None: as configured
        robot_pose  the pose of the robot whose arm carries the scanner, in its own numbers
        poses    the notation of these numbers: "ur", "kuka", "abb", ...
        box      measures only within this box: x, y and z of its least corner, then of its greatest, in mm;
                 (): everything; None: as configured, here and below
        plane    drops points on or behind this plane: x, y and z of its unit normal, and its offset along it, mm
        box_frame  the frame of box and plane
        voxel_mm keeps only the most certain point in each cube with this side length
        stride   keeps the pixels of every Nth row and column; needs density="pixels"
        """
        params = _params(format="ply", preset=preset, transport="memfd" if shared else "inline", timeout_ms=_milliseconds(timeout_s),
                         density=density, normals=normals, texture=texture, colour=colour, ambient=ambient,
                         picture=picture, camera=camera, frames="raw" if frames else None, why=why,
                         coordinate_frame=coordinate_frame, robot_pose=_numbers(robot_pose), poses=poses,
                         box=_numbers(box), plane=_numbers(plane), box_frame=box_frame, voxel_mm=voxel_mm, stride=stride)
        answer = self._call("scan", params, timeout_s)
        cloud = read_ply(_need(answer, "the cloud"), answer.result)
        for event, data in answer.events:
            if event["method"] == "picture":
                cloud.picture = bytes(_body(data, "the picture"))
            elif event["method"] == "frame":
                cloud.frames.append(_frame(event["params"], _body(data, "the frame")))
        return cloud

    def save(self, file: str | os.PathLike[str], *, timeout_s: float | None = 5.0, density: Density | None = None,
             normals: bool = False, texture: bool = False, colour: bool = False,
             ambient: bool = False) -> dict[str, Any]:
        """Takes one scan into a file. Its name gives the format: .ply, .pcd, or with pixels .tiff (a depth map).

        file  the file to write; it appears whole or not at all
        The other options are those of `scan`. Returns the scan's description.
        `Cloud.save` writes a cloud that you already have.
        """
        target = pathlib.Path(file)
        kind = _FILES.get(target.suffix.lower())
        if kind is None:
            raise ValueError(f"{target}: the file of a cloud must end in {', '.join(_FILES)}")
        params = _params(format=kind, timeout_ms=_milliseconds(timeout_s), density=density, normals=normals,
                         texture=texture, colour=colour, ambient=ambient)
        part = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
        with open(part, "wb") as out:  # fails before the scan if the place cannot be written
            try:
                answer = self._call("scan", params, timeout_s)
                out.write(_need(answer, "the cloud"))
                out.flush()
                os.replace(part, target)
            except BaseException:
                part.unlink(missing_ok=True)
                raise
        return answer.result

    def stream(self, *, rate_hz: float | None = None, density: Density | None = None, normals: bool = False,
               shared: bool = False, idle_s: float | None = None) -> Generator[Cloud, None, None]:
        """Yields clouds as they come, the newest first. `lost` counts those that the reader was too slow for.

        The stream has its own connection until the iterator is closed. If a scan fails, the service repeats it; if the
        service gives up, the stream raises the error.

        rate_hz  clouds a second at most, 0.001 to 1000; None: every frame
        density, normals   as in `scan`
        shared   the points lie in memory shared with the service, without a copy; while you keep two clouds, others are
                 lost
        idle_s   raises TimedOut if no cloud comes for so many seconds, more than 0; None waits for ever
        """
        if idle_s is not None and not idle_s > 0:
            raise InvalidRequest(f"idle_s must be more than 0 seconds, or None to wait for ever; it is {idle_s!r}",
                                 "invalid_params", "idle_s")
        return self._clouds(_params(format="ply", rate_hz=rate_hz, density=density, normals=normals,
                                    transport="memfd" if shared else None), idle_s)

    def frame(self, camera: str | None = None, *, as_shown: bool = False, timeout_s: float | None = 5.0) -> Frame:
        """Takes a camera's frame under the pattern.

        camera    the camera's name; None: the first
        as_shown  takes the frame under the picture that the projector already shows
        """
        params = _params(format="raw", timeout_ms=_milliseconds(timeout_s), as_shown=as_shown, camera=camera)
        answer = self._call("frame", params, timeout_s)
        return _frame(answer.result, _need(answer, "the frame"))

    def preview(self, camera: str | None = None, *, timeout_s: float | None = 5.0) -> bytes:
        """Takes a frame and draws the decoded symbols in, as PNG.

        camera  the camera's name; None: the first
        """
        params = _params(timeout_ms=_milliseconds(timeout_s), camera=camera)
        return bytes(_need(self._call("preview", params, timeout_s), "the picture"))

    def project(self, picture: Picture, png: bytes | None = None, *, timeout_s: float | None = 5.0) -> None:
        """Projects a picture, and returns once it is visible.

        picture  "pattern", "idle", "black", "white", "focus", "grid", or an "image" of the projector's size
        png      only with "image": the bytes of its PNG file
        """
        self._call("project", _params(picture=picture, timeout_ms=_milliseconds(timeout_s),
                                      png=None if png is None else base64.b64encode(png).decode()), timeout_s)

    def pattern(self) -> bytes:
        """Returns the pattern's image, as PNG."""
        return bytes(_need(self._call("pattern", {}, GRACE_S), "the pattern"))

    def status(self) -> dict[str, Any]:
        """Returns the state of the service and its devices, and the counts of all scans."""
        return self._call("status", {}, GRACE_S).result

    def metrics(self) -> str:
        """Returns the service's metrics, as OpenMetrics text."""
        return bytes(_need(self._call("metrics", {}, GRACE_S), "the metrics")).decode()

    def bundle(self) -> bytes:
        """Returns the last scans with their frames, as a tar archive. `slsd --replay` decodes it again."""
        return bytes(_need(self._call("bundle", {}, _RELOAD_MAX_S), "the bundle"))

    def settings(self) -> dict[str, Any]:
        """Returns the settings that clouds depend on: pattern, calibration, projector, cameras, configuration."""
        return self._call("settings", {}, GRACE_S).result

    def set(self, *, decode: DecodeSettings | None = None, calibration: CalibrationSettings | None = None,
            pattern: PatternSettings | None = None, camera: Mapping[str, CameraSettings] | None = None,
            cloud: CloudSettings | None = None) -> dict[str, Any]:
        """Changes settings at once, and keeps them over restarts. A value of None takes a setting back.

        decode, calibration, pattern, cloud   keys of these tables of the configuration
        camera   exposure and gain of each camera, by its name

        Returns `set` (all settings now set), `not_kept` (None, or why a restart forgets them) and `needs_restart`.
        If the service refuses any setting, all stay as they were.
        """
        return self._call("set", _params(decode=decode, calibration=calibration, pattern=pattern, camera=camera,
                                           cloud=cloud), _RELOAD_MAX_S).result

    def exposure(self, camera: str | None = None, *, exposure_us: float | None = None, gain_db: float | None = None
                 ) -> Exposure:
        """Sets a camera's exposure and gain if given, and returns both. `slsctl exposure` measures the light and advises.

        camera       the camera's name; None: the first
        exposure_us  the exposure time, in microseconds
        gain_db      the gain above the camera's least
        """
        cameras: list[dict[str, Any]] = self.settings().get("cameras", [])
        about = next((each for each in cameras if camera in (None, each.get("name"))), None)
        if about is None:
            known = ", ".join(str(each.get("name")) for each in cameras) or "none is configured"
            raise NotFound(f"no such camera: {camera!r} (configured: {known})", "not_found", camera or "camera")
        wanted: CameraSettings = {}
        if exposure_us is not None:
            wanted["exposure_us"] = exposure_us
        if gain_db is not None:
            wanted["gain_db"] = gain_db
        if wanted:
            self.set(camera={about["name"]: wanted})
            return self.exposure(about["name"])
        return Exposure(about["name"], about.get("exposure_us"), about.get("gain_db"))

    def calibrate(self, *, board: str | None = None, ruler: str | None = None, code: Code = "pattern",
                  poses: int = 12, resume: bool = False, told: Callable[[dict[str, Any]], None] | None = None
                  ) -> dict[str, Any]:
        """Calibrates with a board that somebody moves, and returns when the calibration is in force.

        board, ruler   as for `slsd --calibrate`; None: its defaults
        code     the pictures to project onto the board: "pattern" or "gray"
        poses    how many poses to take, 3 to 99
        resume   keeps the pictures of the last session
        told     called with the session's state (its `progress` and `log`) whenever it changes

        Returns the last state, with `outcome` (grade, reasons, errors in pixels). Raises ScannerError if calibration
        fails. An exception in the meantime (Ctrl-C, or one of `told`) cancels the session.
        """
        params = _params(action="begin", board=board, ruler=ruler, code=code, poses=poses, resume=resume)
        state = self._call("calibrate", params, GRACE_S).result
        number = None
        try:
            while True:
                if told is not None and state.get("number") != number:
                    told(state)
                number = state.get("number")
                if not state.get("under_way"):
                    break
                time.sleep(_LOOK_EVERY_S)
                state = self.calibration()
        except BaseException:
            try:
                self.calibration("cancel")
            except ScannerError:
                pass  # the reason is the first exception
            raise
        if state.get("error") is not None:
            raise ScannerError(str(state["error"]), "impossible")
        return state

    def calibration(self, action: Literal["look", "end", "cancel"] = "look") -> dict[str, Any]:
        """Returns the state of the calibration session.

        action  "end": finish with the poses taken so far; "cancel": cancel the session; "look": change nothing
        """
        return self._call("calibrate", {"action": action}, GRACE_S).result

    @property
    def role(self) -> str:
        """The role of this user: "observe", "scan" (which includes observing) or "administer" (everything)."""
        role = self.status().get("role")
        if not isinstance(role, str):
            raise ProtocolError("the service reports no role: it is older than this package")
        return role

    def reload(self) -> list[str]:
        """Reads the configuration again. Returns the names of tables that need a restart."""
        return list(self._call("reload", {}, _RELOAD_MAX_S).result.get("needs_restart", []))

    def _call(self, method: str, params: dict[str, Any], timeout_s: float | None) -> Answer:
        return self._channel.call(method, params, _TIMEOUT_MAX_S if timeout_s is None else timeout_s)

    def _clouds(self, params: dict[str, Any], idle_s: float | None) -> Generator[Cloud, None, None]:
        events = subscribed(self._channel.path, params, idle_s)
        try:
            for event, data in events:
                if event["method"] == "cloud":
                    yield read_ply(_body(data, "the cloud"), event["params"])
        finally:
            events.close()


def _params(**values: Any) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None and value is not False}


def _numbers(values: Sequence[float] | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _milliseconds(seconds: float | None) -> int | None:
    if seconds is None:
        return None
    if not 0.001 <= seconds <= _TIMEOUT_MAX_S:
        raise InvalidRequest(f"timeout_s must be 0.001 to {_TIMEOUT_MAX_S:g} seconds, or None for the time that the "
                             f"service's configuration says; it is {seconds!r}", "invalid_params", "timeout_s")
    return round(1000 * float(seconds))


def _need(answer: Answer, what: str) -> Any:
    return _body(answer.body, what)


def _body(body: Body, what: str) -> Any:
    if body is None:
        raise ProtocolError(f"{what} is missing from the answer")
    return body


def _frame(description: dict[str, Any], body: Any) -> Frame:
    try:
        width, height, bits = (int(description[key]) for key in ("width_px", "height_px", "bits"))
    except (KeyError, TypeError, ValueError) as error:
        raise ProtocolError("a frame lacks its size") from error
    kind = np.dtype("<u2" if bits > 8 else "u1")
    if width <= 0 or height <= 0 or width * height * kind.itemsize != len(body):
        raise ProtocolError(f"a frame of {width}x{height} px has {len(body)} bytes")
    return Frame(np.frombuffer(body, kind).reshape(height, width), dict(description))
