# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Reads meshes by assimp, which shares no code with our writers."""
import pathlib
import re
import subprocess
import tempfile
import xml.etree.ElementTree as xml


class ForeignMesh:
    """The only mesh of a file: vertices, normals, colours (empty: none) and triangles, as assimp reads them."""

    def __init__(self, file):
        with tempfile.TemporaryDirectory(prefix="slsd-test-") as folder:
            dump = pathlib.Path(folder) / "dump.assxml"
            done = subprocess.run(("assimp", "dump", file, dump), capture_output=True, text=True, check=False, timeout=300)
            if not dump.exists():
                raise AssertionError(f"assimp does not read {file}: {done.stdout} {done.stderr}")
            text = dump.read_text(encoding="utf-8", errors="replace")
        scene = xml.fromstring(re.sub(r"<(MatProperty|MaterialList).*?</\1>", "", text, flags=re.S))
        mesh, = scene.iter("Mesh")
        self.vertices = _rows(mesh.find("Positions"), 3)
        self.normals = _rows(mesh.find("Normals"), 3)
        self.colours = _rows(mesh.find("Colors"), 4)
        self.triangles = [tuple(map(int, face.text.split())) for face in mesh.iter("Face")]


def _rows(element, width):
    numbers = [] if element is None else [float(number) for number in element.text.split()]
    return [tuple(numbers[i:i + width]) for i in range(0, len(numbers), width)]
