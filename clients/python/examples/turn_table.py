# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Merges views of a turn-table in one frame: press Enter after each turn by 360/VIEWS degrees.

Measure the table's axis once, as a point (mm) and a direction in the scanner's frame. Put a sphere on the table: its centres lie on a
circle about the axis (axis_of). The recorded frames of six views: slsd --config tests/clients/recorded/turn_table/slsd.toml,
then with SLSD_SOCKET=/tmp/slsd-example.sock turn_table.py all.npy 6 0,0,2010 0,1,0
"""
import argparse
import sys

import numpy as np

import slsd


def turned(points, angle_rad, point_on_axis_mm, axis):
    """The points, turned about the axis by the right-hand rule (Rodrigues)."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    away = np.asarray(points, float) - point_on_axis_mm
    return (away * np.cos(angle_rad) + np.cross(axis, away) * np.sin(angle_rad)
            + np.outer(away @ axis, axis) * (1 - np.cos(angle_rad)) + point_on_axis_mm)


def axis_of(centres):
    """The axis about which these points turn: a point on it and its direction. It needs three points or more, not too close."""
    centres = np.asarray(centres, float)
    middle = centres.mean(axis=0)
    _, spread, directions = np.linalg.svd(centres - middle)
    if len(centres) < 3 or spread[1] < 1e-3 * spread[0]:
        raise ValueError("the centres lie on a line: turn the table further")
    plane = (centres - middle) @ directions[:2].T  # the circle in its plane: |p|^2 = 2 p c + d
    solved, *_ = np.linalg.lstsq(np.column_stack([2 * plane, np.ones(len(plane))]), (plane**2).sum(axis=1), rcond=None)
    return middle + solved[:2] @ directions[:2], directions[2]


def merged(views, point_on_axis_mm, axis):
    """Views at equal steps of one turn, turned back to the first."""
    step = 2 * np.pi / len(views)
    return np.concatenate([turned(view, -i * step, point_on_axis_mm, axis) for i, view in enumerate(views)])


def vector(text):
    x, y, z = (float(word) for word in text.split(","))
    return np.array([x, y, z])


def main(out, count, point_on_axis_mm, axis):
    views = []
    with slsd.Scanner() as scanner:
        for i in range(count):
            input(f"view {i + 1} of {count}: ")
            views.append(scanner.scan(timeout_s=60).xyz)
    np.save(out, merged(views, point_on_axis_mm, axis))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.npy")
    parser.add_argument("count", type=int, metavar="VIEWS")
    parser.add_argument("point", nargs="?", type=vector, default=vector("0,0,1000"), metavar="X,Y,Z", help="on the axis, mm")
    parser.add_argument("axis", nargs="?", type=vector, default=vector("0,1,0"), metavar="DX,DY,DZ")
    words = sys.argv[1:]
    options = parser.parse_args(words if "--help" in words else ["--", *words])  # numbers may be negative
    if options.count < 1 or not options.axis.any():
        parser.error("VIEWS must be 1 or more, and the axis needs a direction")
    try:
        main(options.out, options.count, options.point, options.axis)
    except EOFError:
        parser.error("standard input ended before all views were there")
    except (slsd.ScannerError, OSError) as error:
        parser.error(str(error))
