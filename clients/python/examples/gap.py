# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Measures how far one face stands in front of another, with the uncertainty.

Give two rectangles in x and y (mm, the scanner's frame), one on each face, clear of its edges. Distances start at the plane of the first
face. Several scans (5) average the noise of the frames, and show it. The recorded frame with two such faces:
slsd --config tests/clients/recorded/gap/slsd.toml, then with SLSD_SOCKET=/tmp/slsd-example.sock
gap.py 160,110,240,230 98,148,142,192
"""
import argparse
import sys

import numpy as np

import slsd

PARTS = 4  # divides the face into so many parts by as many; their disagreement is no noise of pixels


def face(points, rectangle):
    """Middle, normal away from the scanner, and the covariance of (offset, slope in x, slope in y) of a face's plane."""
    x0, y0, x1, y1 = rectangle
    inside = (points["x"] > x0) & (points["x"] < x1) & (points["y"] > y0) & (points["y"] < y1)
    xyz = np.stack([points[axis][inside] for axis in "xyz"], axis=1).astype(float)
    if len(xyz) < 20 * PARTS**2:
        raise ValueError(f"{len(xyz)} points in the rectangle: is it on the face, and lit?")
    middle = np.median(xyz, axis=0)
    for _ in range(3):  # leaves out points off the plane
        design = np.column_stack([np.ones(len(xyz)), xyz[:, :2] - middle[:2]])
        plane, *_ = np.linalg.lstsq(design, xyz[:, 2], rcond=None)
        off = xyz[:, 2] - design @ plane
        near = np.abs(off) < 4 * 1.4826 * np.median(np.abs(off)) + 1e-6
        xyz = xyz[near]
    part = np.floor((xyz[:, :2] - (x0, y0)) / ((x1 - x0) / PARTS, (y1 - y0) / PARTS)).astype(int) @ (1, PARTS)
    means = np.array([np.append(np.append(1, (xyz[part == i, :2] - middle[:2]).mean(axis=0)), off[near][part == i].mean())
                      for i in np.unique(part)])
    covariance = (means[:, 3]**2).sum() / (len(means) - 3) * np.linalg.inv(means[:, :3].T @ means[:, :3])
    normal = np.array([-plane[1], -plane[2], 1]) / np.sqrt(1 + plane[1]**2 + plane[2]**2)
    return np.array([middle[0], middle[1], plane[0]]), normal, covariance


def gap(points, behind, before):
    """Distance of the middle of `before` from the plane of `behind`, mm, and its standard deviation."""
    middle, normal, covariance = face(points, behind)
    other, _, covariance_other = face(points, before)
    lever = np.append(1, (other - middle)[:2])  # a slope of the first face counts by the distance to the second
    return (middle - other) @ normal, np.sqrt(lever @ covariance @ lever + covariance_other[0, 0])


def rectangle_of(text):
    x0, y0, x1, y1 = (float(word) for word in text.split(","))
    if not (x0 < x1 and y0 < y1):
        raise ValueError
    return x0, y0, x1, y1


def main(behind, before, scans):
    with slsd.Scanner() as scanner:
        clouds = [scanner.scan(density="pixels", timeout_s=60) for _ in range(scans)]
    each = np.array([gap(cloud.points, behind, before) for cloud in clouds])
    # The parts' disagreement stays the same from scan to scan. Averaging reduces the frames' noise, not the disagreement.
    sigma = np.hypot(np.median(each[:, 1]), each[:, 0].std() / np.sqrt(len(each)))
    print(f"gap {each[:, 0].mean():.3f} mm, one standard deviation {sigma:.3f} mm ({len(each)} scans, which differ by "
          f"{each[:, 0].std():.3f})")
    # An error of the calibration moves both faces together. The gap gets its share of it, by depth.
    if clouds[0].sigma_calibration_mm is not None:
        depth = clouds[0].points["z"].mean()
        print(f"and {clouds[0].sigma_calibration_mm * 2 * abs(each[:, 0].mean()) / depth:.3f} mm from the calibration")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("behind", type=rectangle_of, metavar="X0,Y0,X1,Y1", help="on the face that distances count from")
    parser.add_argument("before", type=rectangle_of, metavar="X0,Y0,X1,Y1", help="on the other face")
    parser.add_argument("scans", nargs="?", type=int, default=5, metavar="SCANS")
    words = sys.argv[1:]
    options = parser.parse_args(words if "--help" in words else ["--", *words])  # numbers may be negative
    if options.scans < 1:
        parser.error("SCANS must be 1 or more")
    try:
        main(options.behind, options.before, options.scans)
    except (slsd.ScannerError, ValueError) as error:
        parser.error(str(error))
