# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""How far one face stands before another, with its uncertainty: gap.py X0,Y0,X1,Y1 X0,Y0,X1,Y1 [SCANS]

Two rectangles in x and y (mm, the scanner's frame), one on each face, clear of its edges. The first face is the plane that distances
count from. Several scans (5) average the noise of the frames, and show it.
"""
import sys

import numpy as np

import slsd

PARTS = 4  # the face is looked at in so many parts by as many: what they disagree in is no noise of pixels


def face(points, rectangle):
    """Middle, normal away from the scanner, and the covariance of (offset, slope in x, slope in y) of a face's plane."""
    x0, y0, x1, y1 = rectangle
    inside = (points["x"] > x0) & (points["x"] < x1) & (points["y"] > y0) & (points["y"] < y1)
    xyz = np.stack([points[axis][inside] for axis in "xyz"], axis=1).astype(float)
    if len(xyz) < 20 * PARTS**2:
        raise ValueError(f"{len(xyz)} points in the rectangle: is it on the face, and lit?")
    middle = np.median(xyz, axis=0)
    for _ in range(3):  # without what lies elsewhere
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
    """How far the middle of `before` stands before the plane of `behind`, mm, and one standard deviation of it."""
    middle, normal, covariance = face(points, behind)
    other, _, covariance_other = face(points, before)
    lever = np.append(1, (other - middle)[:2])  # a slope of the first face counts by how far away the second is
    return (middle - other) @ normal, np.sqrt(lever @ covariance @ lever + covariance_other[0, 0])


def main(behind, before, scans=5):
    behind, before = (tuple(float(word) for word in text.split(",")) for text in (behind, before))
    with slsd.Scanner() as scanner:
        clouds = [scanner.scan(density="pixels", timeout_s=60) for _ in range(int(scans))]
    each = np.array([gap(cloud.points, behind, before) for cloud in clouds])
    # The parts' disagreement stays the same from scan to scan: averaging takes the frames' noise out of the gap, not that.
    sigma = np.hypot(np.median(each[:, 1]), each[:, 0].std() / np.sqrt(len(each)))
    print(f"gap {each[:, 0].mean():.3f} mm, one standard deviation {sigma:.3f} mm ({len(each)} scans, which differ by "
          f"{each[:, 0].std():.3f})")
    # Both faces move together where the calibration is off: of that, the gap has its share by depth.
    if clouds[0].sigma_calibration_mm is not None:
        depth = clouds[0].points["z"].mean()
        print(f"and {clouds[0].sigma_calibration_mm * 2 * abs(each[:, 0].mean()) / depth:.3f} mm from the calibration")


if __name__ == "__main__":
    main(*sys.argv[1:])
