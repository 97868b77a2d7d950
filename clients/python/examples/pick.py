# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Finds a place for a suction cup on the topmost part in a bin.

It chooses the nearest place that is flat enough for a cup of this diameter in mm (40). It prints the point (mm, the scanner's frame), the
direction to come from, and how certain the place is. The recorded frame with boxes:
slsd --config tests/clients/cell/left/slsd.toml, then with SLSD_SOCKET=/tmp/slsd-example.sock pick.py 80
"""
import argparse
import sys

import numpy as np

import slsd

FLAT_MM = 0.5    # how far a surface may be off a plane for the cup to hold
COVERED = 0.9    # the share of the cup's area that must have points


def patches(xyz, cup_mm):
    """Points by squares of a cup's width, seen along z, in two grids that are half a width apart."""
    for shift in (0, cup_mm / 2):
        cells = np.floor((xyz[:, :2] + shift) / cup_mm).astype(int)
        _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        which = which.ravel()
        order = np.argsort(which, kind="stable")
        for part in np.split(order, np.flatnonzero(np.diff(which[order])) + 1):
            yield xyz[part]


def plane_of(points):
    """Middle, unit normal towards the scanner, root mean square distance from the plane."""
    middle = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal = axes[2] if axes[2] @ middle < 0 else -axes[2]
    return middle, normal, spread[2] / np.sqrt(len(points))


def places(xyz, cup_mm):
    """(point, normal, off_mm) of all places that hold, the nearest first."""
    density = np.median([len(patch) for patch in patches(xyz, cup_mm)])
    found = []
    for patch in patches(xyz, cup_mm):
        if len(patch) < COVERED * density:
            continue
        middle, normal, off_mm = plane_of(patch)
        covered = np.ptp(patch[:, :2], axis=0).min() > COVERED * cup_mm
        if off_mm < FLAT_MM and covered:
            found.append((middle, normal, off_mm))
    return sorted(found, key=lambda place: place[0][2])


def main(cup_mm):
    with slsd.Scanner() as scanner:
        cloud = scanner.scan(density="pixels", timeout_s=60)
    found = places(cloud.xyz.astype(float), cup_mm)
    if not found:
        sys.exit("no place for this cup: the bin is empty, or nothing in it is flat")
    point, normal, off_mm = found[0]
    print("point mm {:.2f} {:.2f} {:.2f}, normal {:.4f} {:.4f} {:.4f}, flat to {:.2f} mm, {} places".format(
        *point, *normal, off_mm, len(found)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cup_mm", nargs="?", type=float, default=40.0, metavar="CUP_MM")
    options = parser.parse_args()
    if not options.cup_mm > 0:
        parser.error("CUP_MM must be more than 0")
    try:
        main(options.cup_mm)
    except slsd.ScannerError as error:
        parser.error(str(error))
