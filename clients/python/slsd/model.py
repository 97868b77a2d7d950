# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Models: one mesh from the clouds of an object that turns in front of the scanner."""
from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from .cloud import Cloud
from .errors import NotFound, ProtocolError, ScannerError

if TYPE_CHECKING:
    from .scanner import Scanner

_TYPES = {"float": "<f4", "uchar": "<u1", "ushort": "<u2"}


class Mesh:
    """A surface of triangles.

    points     structured array, one record for each vertex: x y z (mm, the scanner's frame at the first cloud), sigma_mm,
               red green blue (the intensity, if the clouds have no colours), frames (how many clouds measured it; 0:
               invented by `close`)
    triangles  N x 3 array of indices of vertices, counter-clockwise as seen from outside
    report     of slsd-model: `fused` and `refused` clouds, `closed`, `drift_mm`, `seam_mm`, `invented_share`, ...
    """

    def __init__(self, points: npt.NDArray[Any], triangles: npt.NDArray[np.int32], report: Mapping[str, Any]):
        self.points = points
        self.triangles = triangles
        self.report = dict(report)

    @property
    def xyz(self) -> npt.NDArray[np.float32]:
        """The vertices in mm, as a copy: an N x 3 array of float32."""
        return np.stack([self.points[axis] for axis in "xyz"], axis=1)

    def __repr__(self) -> str:
        return f"<slsd.Mesh: {len(self.points)} vertices, {len(self.triangles)} triangles>"


class Model:
    """Collects clouds of one object and fuses them, weighted by their sigmas, with the program slsd-model.

        with slsd.Scanner() as scanner, slsd.Model(scanner) as model:
            for _ in range(36):
                input("turn the object by 10 degrees, then press Enter")
                model.add(scanner.scan(density="pixels"))
            model.save("part.stl", close=True)

    The object may be turned by hand. Each cloud should overlap the one before: turn by 15 degrees at most.

    calibration  the scanner that measures the clouds, or the text of its calibration
    folder       keeps the clouds in this new folder, as a recording for slsd-model --from; None: in a temporary one
    program      the file of slsd-model

    Raises NotFound if the scanner is not calibrated, or slsd-model is not installed.
    """

    def __init__(self, calibration: Scanner | str, folder: str | os.PathLike[str] | None = None, program: str = "slsd-model"):
        text = calibration if isinstance(calibration, str) else str(calibration.settings().get("calibration") or "")
        if not text:
            raise NotFound("the scanner is not calibrated: run slsd --calibrate", "not_calibrated")
        if shutil.which(program) is None:
            raise NotFound(f"{program} is not installed: install the package slsd-model", "not_found")
        self._temporary = tempfile.TemporaryDirectory(prefix="slsd-model-") if folder is None else None
        self._folder = pathlib.Path(self._temporary.name if self._temporary else str(folder))
        if self._temporary is None:
            self._folder.mkdir(parents=True)
        self._program = program
        self._count = 0
        (self._folder / "clouds").mkdir()
        (self._folder / "calibration.yml").write_text(text, encoding="utf-8")

    def __enter__(self) -> Model:
        return self

    def __exit__(self, *ignored: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self._count

    def close(self) -> None:
        """Deletes the temporary folder, if there is one."""
        if self._temporary is not None:
            self._temporary.cleanup()

    def add(self, cloud: Cloud) -> None:
        """Adds a cloud of pixels in the scanner's frame. Raises ValueError for any other."""
        names = cloud.points.dtype.names or ()
        if "symbol" in names or "sigma_mm" not in names:
            raise ValueError('a model needs clouds of pixels: scan(density="pixels")')
        if cloud.comments.get("coordinate_frame", "rig").startswith("robot_base"):
            raise ValueError('a model needs clouds in the scanner\'s frame: scan(coordinate_frame="rig")')
        name = f"clouds/{self._count:08d}.ply"
        cloud.save(self._folder / name)
        with open(self._folder / "scans.jsonl", "a", encoding="utf-8") as lines:
            lines.write(json.dumps({"cloud": name}) + "\n")
        self._count += 1
        (self._folder / "recording.json").write_text(json.dumps({"scans": self._count}) + "\n", encoding="utf-8")

    def save(self, file: str | os.PathLike[str], *, close: bool = False, voxel_mm: float | None = None,
             box: Sequence[float] | None = None, background: Cloud | None = None) -> dict[str, Any]:
        """Writes the mesh to a .ply, .stl, .obj, .glb or .3mf file, and returns the report.

        close       closes all holes, for 3D printing: invents surface that no cloud measured
        voxel_mm    the mesh's resolution; None: from the clouds' pixels and sigmas
        box         uses only points in this box: x, y and z of its least corner, then of its greatest, mm
        background  leaves out the surfaces in this dense cloud of the empty scene, such as table and wall

        Raises ScannerError if the clouds give no mesh; its text says why.
        """
        words = [self._program, "--from", str(self._folder), "-o", os.fspath(file), "--json"]
        if close:
            words.append("--close")
        if voxel_mm is not None:
            words += ["--voxel", repr(float(voxel_mm))]
        if box is not None:
            words += ["--box", *(repr(float(number)) for number in box)]
        if not self._count:
            raise ScannerError("the model has no clouds: add them first")
        if background is not None:
            background.save(self._folder / "background.ply")
            words += ["--background", str(self._folder / "background.ply")]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ScannerError(done.stderr.strip().rsplit("\n", 1)[-1] or f"{self._program} ended with {done.returncode}")
        report: dict[str, Any] = json.loads(done.stdout)
        return report

    def mesh(self, *, close: bool = False, voxel_mm: float | None = None, box: Sequence[float] | None = None,
             background: Cloud | None = None) -> Mesh:
        """The mesh as arrays. Parameters and errors are those of `save`."""
        with tempfile.TemporaryDirectory(prefix="slsd-model-") as folder:
            file = pathlib.Path(folder) / "mesh.ply"
            report = self.save(file, close=close, voxel_mm=voxel_mm, box=box, background=background)
            return _read_mesh(file.read_bytes(), report)


def _read_mesh(data: bytes, report: Mapping[str, Any]) -> Mesh:
    head, end, body = data.partition(b"end_header\n")
    fields: list[tuple[str, str]] = []
    counts: dict[str, int] = {}
    for line in head.decode("utf-8", "replace").split("\n"):
        words = line.split(" ")
        if words[0] == "element" and len(words) == 3:
            counts[words[1]] = int(words[2])
        elif words[0] == "property" and len(words) == 3 and words[1] in _TYPES:
            fields.append((words[2], _TYPES[words[1]]))
    record, face = np.dtype(fields), np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    vertices, faces = counts.get("vertex", -1), counts.get("face", -1)
    if not end or len(body) != vertices * record.itemsize + faces * face.itemsize:
        raise ProtocolError("slsd-model wrote a mesh of another form")
    corners = np.frombuffer(body, face, faces, vertices * record.itemsize)
    return Mesh(np.frombuffer(body, record, vertices), np.ascontiguousarray(corners["corners"]), report)
