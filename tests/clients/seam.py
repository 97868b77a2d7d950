#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Two scanners of one rendered cell: where `slsd --extrinsics` says that they stand, against the truth, and how well their
clouds meet.

    SLSD_BIN=build/release/bin SLSD_SCENE=build/release/tests/daemon/scene tests/clients/seam.py [CELL]

CELL is a folder as tests/clients/cell.
"""
import contextlib
import os
import pathlib
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402

import patience  # noqa: E402, F401
import slsd  # noqa: E402
from service import Service, slsd as run_slsd  # noqa: E402

CELL = HERE / "cell"
SCANNERS = ("left", "right")
CONFIGURATION = """
[pattern]
file = "{source}/config/patterns/16px-5.toml"
[[camera]]
name = "camera"
driver = "file"
path = "{frames}"
[calibration]
file = "{calibration}"
[server]
socket = "slsd.sock"
"""


def service(cell, scanner, frames, calibration=None):
    return Service(configuration=CONFIGURATION.format(
        source=HERE.parents[1], frames=cell / scanner / frames, calibration=calibration or cell / scanner / "calibration.yml"))


def measure_extrinsics(services, file, places, *more):
    return run_slsd("--extrinsics", file, *[word for name, one in services.items() for word in ("--scanner", f"{name}={one.socket}")],
                    "--board", "charuco:11x7:40:30:DICT_5X5_1000", "--places", places, *more, input="\n" * 20)


def read_extrinsics(file, scanner):
    """rotation, translation_mm of the parent from the scanner. (tomllib is younger than the oldest Python that is tested.)"""
    text = pathlib.Path(file).read_text(encoding="utf-8").split(f"[scanner.{scanner}]")[1].split("[scanner.")[0]

    def numbers(key):
        return np.array([float(word) for word in text.split(key + " = [")[1].split("]")[0].split(",")])

    return numbers("rotation").reshape(3, 3), numbers("translation_mm")


def placed(points_mm, extrinsics):
    rotation, translation_mm = extrinsics
    return points_mm @ rotation.T + translation_mm


def steps_at_seam(left, right, cell=1 / 250, rough_mm=0.8):
    """How far the right cloud lies behind the left one along their surface's normal, mm, place by place of what both see: where
    the left one is a plane to `rough_mm` within a cell of its own directions."""
    steps = []
    size = 1 << 12

    def keys(points):
        at = np.floor(points[:, :2] / points[:, 2:] / cell).astype(int) + size // 2
        return at[:, 0] * size + at[:, 1]

    left_keys, right_keys = keys(left), keys(right)
    left, right = left[np.argsort(left_keys, kind="stable")], right[np.argsort(right_keys, kind="stable")]
    left_keys.sort()
    right_keys.sort()
    for key in np.intersect1d(left_keys, right_keys):
        ours = left[slice(*np.searchsorted(left_keys, [key, key + 1]))]
        theirs = right[slice(*np.searchsorted(right_keys, [key, key + 1]))]
        if len(ours) < 20 or len(theirs) < 20:
            continue
        middle = ours.mean(axis=0)
        _, spread, axes = np.linalg.svd(ours - middle, full_matrices=False)
        off = (theirs - middle) @ axes[2] * np.sign(axes[2, 2])
        # Another surface may be in the same directions: what is seen of it is no step.
        if spread[2] / np.sqrt(len(ours)) < rough_mm and off.std() < 2 * rough_mm and abs(np.median(off)) < 5:
            steps.append(off.mean())
    return np.array(steps)


def main():
    cell = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else CELL
    places = len(list((cell / "left/board").glob("*.png")))
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        boards = {name: stack.enter_context(service(cell, name, "board")) for name in SCANNERS}
        done = measure_extrinsics(boards, pathlib.Path(folder) / "cell.toml", places)
        print(done.stdout, done.stderr, sep="", end="")
        measured, truth = read_extrinsics(pathlib.Path(folder) / "cell.toml", "right"), read_extrinsics(cell / "truth.toml", "right")
        for density in ("symbols", "pixels"):
            clouds = []
            for name in SCANNERS:
                with service(cell, name, "scene") as scene, slsd.Scanner(scene.socket) as scanner:
                    clouds.append(scanner.scan(density=density, timeout_s=60).xyz.astype(float))
            off = np.linalg.norm(placed(clouds[1], measured) - placed(clouds[1], truth), axis=1)
            print(f"{density}: {len(clouds[1])} points of the right scanner put off the truth by {np.median(off):.3f} mm (median), "
                  f"{off.max():.3f} (longest)")
            if density == "pixels":
                for what, extrinsics in (("measured", measured), ("true", truth)):
                    steps = steps_at_seam(clouds[0], placed(clouds[1], extrinsics))
                    print(f"  step at the seam, {what} extrinsics: median {np.median(steps):+.3f} mm, mean {steps.mean():+.3f}, "
                          f"RMS {np.sqrt((steps**2).mean()):.3f} over {len(steps)} places")


if __name__ == "__main__":
    main()
