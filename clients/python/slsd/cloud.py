# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Point clouds: a scan's points as a structured array."""
from __future__ import annotations

import mmap
import os
import pathlib
import secrets
from typing import TYPE_CHECKING, Any, Mapping, Union

import numpy as np
import numpy.typing as npt

from .errors import ProtocolError

if TYPE_CHECKING:
    from .scanner import Frame

_TYPES = {"char": "<i1", "uchar": "<u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
          "double": "<f8"}
_HEADER_MAX = 1 << 16

_NAMES = {kind: name for name, kind in _TYPES.items()}
_BEGIN = "ply\nformat binary_little_endian 1.0\n"
_END = "end_header\n"

Buffer = Union[bytes, bytearray, memoryview, mmap.mmap]


class Cloud:
    """The point cloud of one scan.

    points       structured array, one record for each point: x y z (mm, rig frame), sigma_mm, intensity, camera; clouds
                 of symbols also have camera_u camera_v projector_u projector_v (px), symbol, column, row
    description  the scan's description in the reply: its id, times, counts of regions, ...
    comments     the comments of the file's header
    lost         how many clouds a subscriber lost since the previous one, because it read too slowly
    picture, frames   the picture and the frames, if the scan asked for them

    Points of `shared` scans lie in the service's memory. It is released once the cloud and all views of its points are
    gone, in forked children as well. A pickled cloud is a copy.
    """

    def __init__(self, points: npt.NDArray[Any], comments: Mapping[str, str], description: Mapping[str, Any]):
        self.points = points
        self.comments = dict(comments)
        self.description = dict(description)
        self.lost = int(self.description.get("lost", 0))
        self.picture: bytes | None = None
        self.frames: list[Frame] = []

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        why = self.why_empty
        return f"<slsd.Cloud {self.description.get('scan', '')}: {len(self)} points{f': {why}' if why else ''}>"

    @property
    def why_empty(self) -> str | None:
        """Why the cloud is empty, in words; None if it has points."""
        why = self.description.get("empty")
        return None if why is None else str(why)

    @property
    def xyz(self) -> npt.NDArray[np.float32]:
        """The coordinates in mm, as a copy: an N x 3 array of float32."""
        return np.stack([self.points[axis] for axis in "xyz"], axis=1)

    @property
    def normals(self) -> npt.NDArray[np.float32] | None:
        """The unit normals towards the camera, N x 3, if the scan asked for them; else None."""
        if "nx" not in (self.points.dtype.names or ()):
            return None
        normals: npt.NDArray[np.float32] = np.stack([self.points[name] for name in ("nx", "ny", "nz")], axis=1)
        return normals

    @property
    def colours(self) -> npt.NDArray[np.uint8] | None:
        """Red, green and blue of each point, N x 3, 0 to 255, if the scan asked for them; else None."""
        if "red" not in (self.points.dtype.names or ()):
            return None
        colours: npt.NDArray[np.uint8] = np.stack([self.points[name] for name in ("red", "green", "blue")], axis=1)
        return colours

    @property
    def sigma_calibration_mm(self) -> float | None:
        """The standard deviation of the depth from the calibration alone, which moves all points together."""
        value = self.description.get("sigma_calibration_mm", self.comments.get("sigma_calibration_mm"))
        return None if value is None else float(value)

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes the points, as they are now, to a binary PLY file. The file appears whole or not at all.

        `Scanner.save` takes a scan into PCD and TIFF files.
        """
        target = pathlib.Path(file)
        if target.suffix.lower() != ".ply":
            raise ValueError(f"{target}: the file of a cloud must end in .ply; Scanner.save scans into .pcd or .tiff")
        kinds = {name: self.points.dtype[name].newbyteorder("<") for name in self.points.dtype.names or ()}
        for name, kind in kinds.items():
            if kind.str.replace("|", "<") not in _NAMES:
                raise ValueError(f"{target}: PLY has no type for the field {name!r} ({kind})")
        header = [_BEGIN, *(f"comment {name} {text}\n" for name, text in self.comments.items()),
                  f"element vertex {len(self.points)}\n",
                  *(f"property {_NAMES[kind.str.replace('|', '<')]} {name}\n" for name, kind in kinds.items()), _END]
        packed = self.points.astype(list(kinds.items()), copy=False)
        part = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
        try:
            part.write_bytes("".join(header).encode() + packed.tobytes())
            os.replace(part, target)
        except BaseException:
            part.unlink(missing_ok=True)
            raise


def read_ply(data: Buffer, description: Mapping[str, Any] | None = None) -> Cloud:
    """Reads a cloud from the bytes of a binary PLY file. The points are a view of the bytes, not a copy.

    Raises ProtocolError if the header does not match the data.
    """
    view = memoryview(data)
    head = bytes(view[:_HEADER_MAX])
    end = head.find(_END.encode())
    if not head.startswith(_BEGIN.encode()) or end < 0:
        raise ProtocolError("the cloud is not a binary little-endian PLY")
    comments: dict[str, str] = {}
    fields: list[tuple[str, str]] = []
    count = None
    for line in head[:end].decode("utf-8", "replace").split("\n"):
        words = line.split(" ")
        if words[0] == "comment" and len(words) > 1:
            comments[words[1]] = " ".join(words[2:])
        elif words[:2] == ["element", "vertex"] and len(words) == 3 and words[2].isdecimal():
            count = int(words[2])
        elif words[0] == "property" and len(words) == 3 and words[1] in _TYPES:
            fields.append((words[2], _TYPES[words[1]]))
        elif words[0] in ("element", "property"):
            raise ProtocolError(f"the cloud's header has an unknown line: {line[:80]!r}")
    if count is None or not fields or len({name for name, _ in fields}) != len(fields):
        raise ProtocolError("the cloud's header lacks the points")
    body = view[end + len(_END):]
    record = np.dtype(fields)
    if count * record.itemsize != len(body):
        raise ProtocolError(f"the cloud has {len(body)} bytes, but its header says {count} points of "
                            f"{record.itemsize}")
    return Cloud(np.frombuffer(body, record, count), comments, description or {})
