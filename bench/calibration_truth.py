#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Compares a calibration file with the truth of rendered captures:

    calibration_truth.py TRUTH.json CALIBRATION.yml [CAMERA]
    calibration_truth.py --sessions TRUTH.json CALIBRATION.yml [TRUTH.json CALIBRATION.yml ...]

TRUTH.json holds, under "rig": camera and projector with fx fy cx cy and dist, R (3x3, projector from camera) and t (mm).
CAMERA is the name of the one that TRUTH.json tells of; without it the first of the file. Prints each figure beside its
goal, then each parameter's error over the standard deviation that the file reports for it; exit status 1 where a goal
is missed. No parameter may be off by more than 4 deviations. --sessions prints one line for each of several, and the root
mean square of error over deviation over all of them.
"""
import json
import math
import re
import sys


def numbers(text, key):
    """The elements of an OpenCV matrix; the first of that name."""
    found = re.search(rf"^\s*-?\s*{key}: !!opencv-matrix.*?data: \[(.*?)\]", text, re.S | re.M)
    return [float(one) for one in found.group(1).replace("\n", " ").split(",")]


def scalar(text, key):
    return float(re.search(rf"^{key}: (\S+)", text, re.M).group(1))


def section(text, camera):
    """What the file says of a camera, and what it says of the projector: each camera begins with its name."""
    head, *cameras = re.split(r"^ *-\n(?= *name:)", text, flags=re.M)
    if camera is None:
        return cameras[0], head
    return next(one for one in cameras if re.match(rf' *name: "?{re.escape(camera)}"?$', one, re.M)), head


def turn_deg(a, b):
    trace = sum(a[i] * b[i] for i in range(9))  # of a times b transposed
    return math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def project(lens, point):
    x, y = point[0] / point[2], point[1] / point[2]
    k1, k2, p1, p2, k3 = lens["dist"]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (lens["fx"] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + lens["cx"],
            lens["fy"] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + lens["cy"])


def undistort(lens, pixel):
    x = x0 = (pixel[0] - lens["cx"]) / lens["fx"]
    y = y0 = (pixel[1] - lens["cy"]) / lens["fy"]
    for _ in range(60):
        u, v = project(lens, (x, y, 1))
        x += x0 - (u - lens["cx"]) / lens["fx"]
        y += y0 - (v - lens["cy"]) / lens["fy"]
    return x, y


def transform(rotation, translation, p):
    return [sum(rotation[3 * i + j] * p[j] for j in range(3)) + translation[i] for i in range(3)]


def solved_point(rig, lenses, motion, true_motion, p):
    """Where the calibration puts a point of the truth."""
    a = undistort(lenses["camera"], project(rig["camera"], p))
    b = undistort(lenses["projector"], project(rig["projector"], transform(*true_motion, p)))
    rotation, translation = motion
    ray = transform(rotation, [0, 0, 0], (a[0], a[1], 1))
    # (ray * z + t) is parallel to (b, 1): two equations for z, least squares
    rows = [(ray[i] - b[i] * ray[2], b[i] * translation[2] - translation[i]) for i in range(2)]
    z = sum(c * d for c, d in rows) / sum(c * c for c, _ in rows)
    return a[0] * z, a[1] * z, z


def triangulated_share(rig, projector, camera, motion, depth):
    """Length of a line on a plane at a depth, as the calibration sees it, over the truth."""
    true_motion = [e for row in rig["R"] for e in row], rig["t"]
    lenses = {"camera": camera, "projector": projector}
    ends = [(-0.16 * depth, -0.08 * depth, depth * 0.97), (0.12 * depth, 0.1 * depth, depth * 1.03)]
    return math.dist(*(solved_point(rig, lenses, motion, true_motion, end) for end in ends)) / math.dist(*ends)


NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
SIGMAS_MAX = 4


def read_lens(text, name):
    m, dist = numbers(text, f"{name}_matrix"), numbers(text, f"{name}_distortion")
    return {"fx": m[0], "fy": m[4], "cx": m[2], "cy": m[5], "dist": dist, "sigma": numbers(text, f"{name}_sigma")}


def of_goals(rig, lenses, rotation, translation, text):
    rows = []
    for name, lens in lenses.items():
        truth = rig[name]
        rows.append((f"{name}: focal length, %", 100 * max(abs(lens[f] / truth[f] - 1) for f in ("fx", "fy")), 0.1))
        rows.append((f"{name}: principal point, px", max(abs(lens[c] - truth[c]) for c in ("cx", "cy")), 3))
    rows.append(("rotation, degrees", turn_deg(rotation, [e for row in rig["R"] for e in row]), 0.02))
    rows.append(("translation, mm", abs(math.hypot(*translation) - math.hypot(*rig["t"])), 0.2))
    rows.append(("reprojection, camera, px", scalar(text, "reprojection_error_camera_px"), 0.10))
    rows.append(("reprojection, projector, px", scalar(text, "reprojection_error_projector_px"), 0.15))
    for depth in (1500, 2000, 2500):
        share = triangulated_share(rig, lenses["projector"], lenses["camera"], (rotation, translation), depth)
        rows.append((f"distances at {depth} mm, %", 100 * abs(share - 1), 0.05))
    return rows


def of_deviations(rig, lenses):
    """Of every parameter of a lens: name, error, standard deviation."""
    rows = []
    for device, lens in lenses.items():
        for index, name in enumerate(NAMES):
            found, truth = ((lens[name], rig[device][name]) if index < 4 else
                            (lens["dist"][index - 4], rig[device]["dist"][index - 4]))
            if lens["sigma"][index] > 0:
                rows.append((f"{device}: {name}", found - truth, lens["sigma"][index]))
    return rows


def read(truth, calibration, name=None):
    with open(truth, encoding="utf-8") as file:
        rig = json.load(file)["rig"]
    with open(calibration, encoding="utf-8") as file:
        text = file.read()
    camera, head = section(text, name)
    return rig, text, camera, {"camera": read_lens(camera, "camera"), "projector": read_lens(head, "projector")}


def plane_depth_mm(rig, lenses, motion, depth):
    """By how much a plane at a depth seems to be too far away: the mean over what both devices see."""
    true_motion = [e for row in rig["R"] for e in row], rig["t"]
    errors = []
    for x in (-0.15, -0.05, 0.05, 0.15):
        for y in (-0.1, 0.0, 0.1):
            point = (x * depth, y * depth, depth)
            errors.append(solved_point(rig, lenses, motion, true_motion, point)[2] - depth)
    return sum(errors) / len(errors)


def compare_sessions(files):
    missed, squares = False, {}
    print("| session | focal lengths, % (camera; projector) | plane at 1.5, 2, 2.5 m: depth off by, mm | "
          "largest error over deviation |\n|---|---|---|---|")
    for truth, calibration in zip(files[::2], files[1::2]):
        rig, _, camera, lenses = read(truth, calibration)
        focal = [max((lens[f] / rig[name][f] - 1 for f in ("fx", "fy")), key=abs) * 100 for name, lens in lenses.items()]
        depths = [plane_depth_mm(rig, lenses, (numbers(camera, "R"), numbers(camera, "T")), d) for d in (1500, 2000, 2500)]
        ratios = {name: error / sigma for name, error, sigma in of_deviations(rig, lenses)}
        worst = max(ratios, key=lambda name: abs(ratios[name]))
        for name, ratio in ratios.items():
            squares.setdefault(name, []).append(ratio * ratio)
        missed |= abs(ratios[worst]) > SIGMAS_MAX
        print(f"| {calibration} | {focal[0]:+.3f}; {focal[1]:+.3f} | {', '.join(f'{d:+.2f}' for d in depths)} | "
              f"{ratios[worst]:+.1f} ({worst}) |")
    for name, all_of_it in squares.items():
        print(f"{name}: error over deviation {math.sqrt(sum(all_of_it) / len(all_of_it)):.2f} (RMS of {len(all_of_it)})")
    whole = [square for all_of_it in squares.values() for square in all_of_it]
    print(f"all parameters: {math.sqrt(sum(whole) / len(whole)):.2f}")
    return 1 if missed else 0


def main():
    if sys.argv[1] == "--sessions":
        return compare_sessions(sys.argv[2:])
    rig, text, camera, lenses = read(sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None)
    missed = False
    print("| figure | found | goal |\n|---|---|---|")
    for name, value, goal in of_goals(rig, lenses, numbers(camera, "R"), numbers(camera, "T"), text):
        missed |= value > goal
        print(f"| {name} | {value:.4f} | {goal} |{' missed' if value > goal else ''}")
    print("\n| parameter | error | deviation | error over it |\n|---|---|---|---|")
    for name, error, sigma in of_deviations(rig, lenses):
        beyond = abs(error) > SIGMAS_MAX * sigma
        missed |= beyond
        print(f"| {name} | {error:.5f} | {sigma:.5f} | {error / sigma:.1f} |{' missed' if beyond else ''}")
    print(f"\nall parameters within {SIGMAS_MAX} deviations, all goals: {'no' if missed else 'yes'}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
