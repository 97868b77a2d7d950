# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Views of a turn-table in one frame: turn_table.py OUT.npy VIEWS [X,Y,Z DX,DY,DZ]  (Enter after each turn by 360/VIEWS degrees)

Its axis is measured once, as a point (mm) and a direction in the scanner's frame: with a sphere on the table, the circle that
its centres describe (axis_of).
"""
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
    """The axis about which these points turn: a point on it and its direction. At least three, not too near each other."""
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


def main(out, count, point_on_axis_mm="0,0,1000", axis="0,1,0"):
    point, direction = (np.array([float(word) for word in text.split(",")]) for text in (point_on_axis_mm, axis))
    views = []
    with slsd.Scanner() as scanner:
        for i in range(int(count)):
            input(f"view {i + 1} of {count}: ")
            views.append(scanner.scan(timeout_s=60).xyz)
    np.save(out, merged(views, point, direction))


if __name__ == "__main__":
    main(*sys.argv[1:])
