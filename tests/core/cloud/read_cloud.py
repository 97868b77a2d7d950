#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Reads binary PLY and PCD files from their format descriptions alone, and compares them with the same points as text.

    read_cloud.py FOLDER COLUMNS ROWS CAMERAS      (cloud.ply, cloud.pcd and cloud.txt in FOLDER)
"""
import math
import struct
import sys

PLY_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f",
             "double": "d"}
PCD_TYPES = {("F", 4): "f", ("F", 8): "d", ("U", 1): "B", ("U", 2): "H", ("U", 4): "I", ("I", 1): "b", ("I", 2): "h",
             ("I", 4): "i"}


def records(layout, names, body, count):
    form = struct.Struct("<" + layout)
    if len(body) != form.size * count:
        sys.exit(f"{len(body)} bytes for {count} points of {form.size}")
    return [dict(zip(names, values)) for values in form.iter_unpack(body)]


def read_ply(path):
    header, body = open(path, "rb").read().split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    if lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        sys.exit("not a binary little-endian PLY")
    comments = dict(line.split(" ", 2)[1:] for line in lines if line.startswith("comment "))
    elements = [line.split() for line in lines if line.startswith("element ")]
    properties = [line.split() for line in lines if line.startswith("property ")]
    if [element[1] for element in elements] != ["vertex"]:
        sys.exit("elements other than one of vertices")
    layout = "".join(PLY_TYPES[kind] for _, kind, _ in properties)
    return comments, records(layout, [name for _, _, name in properties], body, int(elements[0][2]))


def read_pcd(path):
    header, body = open(path, "rb").read().split(b"DATA binary\n", 1)
    lines = [line for line in header.decode("ascii").splitlines() if not line.startswith("#")]
    keys = {line.split()[0]: line.split()[1:] for line in lines}
    if keys["VERSION"] != ["0.7"] or set(keys["COUNT"]) != {"1"}:
        sys.exit("not a PCD 0.7 of single values")
    width, height, count = (int(keys[key][0]) for key in ("WIDTH", "HEIGHT", "POINTS"))
    if width * height != count:
        sys.exit("WIDTH x HEIGHT is not POINTS")
    if keys["TYPE"][keys["FIELDS"].index("intensity")] != "F":
        sys.exit("intensity is no float, as PCL's PointXYZI has it")
    layout = "".join(PCD_TYPES[kind, int(size)] for kind, size in zip(keys["TYPE"], keys["SIZE"]))
    return width, height, records(layout, keys["FIELDS"], body, count)


def same(point, expected):
    return len(point) == len(expected) and all(math.isclose(a, float(b), rel_tol=1e-7, abs_tol=1e-12)
                                               for a, b in zip(point.values(), expected))


def main(folder, columns, rows, cameras):
    expected = [line.split() for line in open(f"{folder}/cloud.txt")]
    comments, ply = read_ply(f"{folder}/cloud.ply")
    assert len(ply) == len(expected) > 0, "PLY: number of points"
    assert all(map(same, ply, expected)), "PLY: values"
    assert comments["scan_id"] == "scan-11" and comments["time"] == "2026-03-01T12:00:00.000Z", "PLY: comments"
    assert comments["units"].startswith("mm") and int(comments["frame"]) > 0, "PLY: comments"
    width, height, pcd = read_pcd(f"{folder}/cloud.pcd")
    assert (width, height) == (columns, rows * cameras), "PCD: lattice"
    there = [(i, point) for i, point in enumerate(pcd) if not math.isnan(point["x"])]
    assert len(there) == len(expected) and all(same(point, line) for (_, point), line in zip(there, expected)), "PCD"
    assert all(i == (p["camera"] * rows + p["row"]) * columns + p["column"] for i, p in there), "PCD: cells"
    print(f"{len(expected)} points agree")


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]))
