#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Makes the faults of sessions, one at a time, of a good one, and prints what slsd-calibrate says of each:

    calibration_faults.py SLSD-CALIBRATE SESSION TRUTH.json BOARD [--config FILE] [--only WORD]

SESSION holds 12 poses or more, each with white.png and pattern.png, of one camera, whose lens is in TRUTH.json as for
calibration_truth.py. The calibration of the whole session is in force before each fault; a row whose words are not
said, or after which it is not as the row tells, is marked FAILED, and the exit status is 1. Needs OpenCV for Python.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import cv2
import numpy as np

arguments = argparse.ArgumentParser(usage=__doc__)
arguments.add_argument("program")
arguments.add_argument("session", type=pathlib.Path)
arguments.add_argument("truth", type=pathlib.Path)
arguments.add_argument("board")
arguments.add_argument("--config")
arguments.add_argument("--only", default="")
arguments = arguments.parse_args()
NAMES = sorted(pose.name for pose in arguments.session.glob("pose_*"))


def change(folder, pose, pictures, how):
    for picture in pictures:
        file = folder / pose / f"{picture}.png"
        changed = how(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE))
        file.unlink()
        cv2.imwrite(str(file), changed)


def on_board(folder, pose):
    """The middle of the board, roughly: of what is lit."""
    white = cv2.imread(str(folder / pose / "white.png"), cv2.IMREAD_GRAYSCALE)
    rows, columns = np.where(white > 60)
    return int(rows.mean()), int(columns.mean())


def turned(axis, degrees):
    """A picture as the camera takes it that is turned about its own centre."""
    lens = json.loads(arguments.truth.read_text(encoding="utf-8"))["rig"]["camera"]
    matrix = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    rotation = cv2.Rodrigues(np.radians(degrees) * np.array(axis, float))[0]

    def distorted(rays):
        x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
        k1, k2, p1, p2, k3 = lens["dist"]
        square = x * x + y * y
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        return np.stack([x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
                         y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y, np.ones(len(x))], 1)

    def how(image):
        rows, columns = np.indices(image.shape, dtype=np.float64)
        seen = np.stack([(columns.ravel() - lens["cx"]) / lens["fx"], (rows.ravel() - lens["cy"]) / lens["fy"], np.ones(rows.size)], 1)
        rays = seen.copy()
        for _ in range(20):  # the distortion undone
            off = seen - distorted(rays)
            rays[:, :2] += off[:, :2]
        from_there = distorted(rays @ rotation.T) @ matrix.T
        where = from_there[:, :2].reshape(*image.shape, 2).astype(np.float32)
        return cv2.remap(image, where[..., 0], where[..., 1], cv2.INTER_LANCZOS4)
    return how


def swap(folder):
    one, other = (folder / NAMES[i] / "pattern.png" for i in (2, 6))
    one.rename(folder / "kept")
    other.rename(one)
    (folder / "kept").rename(other)


def copies(folder):
    for i, name in enumerate(NAMES[3:], 3):
        shutil.rmtree(folder / name)
        shutil.copytree(folder / NAMES[i % 3], folder / name)


def same_poses_anew(folder):
    """As copies(), with noise of their own."""
    copies(folder)
    noise = np.random.default_rng(1)
    for name in NAMES[3:]:
        change(folder, name, ("white", "pattern"),
               lambda image: np.clip(image + noise.normal(0, 1.5, image.shape), 0, 255).astype(np.uint8))


def clipped(factor):
    return lambda folder: change(folder, NAMES[5], ("white", "pattern"),
                                 lambda image: np.clip(factor * image.astype(float), 0, 255).astype(np.uint8))


def burnt(share):
    """As a reflection does: that share of the board at full level in both pictures, the rest as it was."""
    def how(image):
        rows, columns = np.where(image > 60)
        last = np.quantile(columns, share)
        image[rows[columns < last], columns[columns < last]] = 255
        dark = (slice(rows.min(), rows.max()), slice(columns.min(), int(last)))
        image[dark] = 255
        return image
    return lambda folder: change(folder, NAMES[5], ("white", "pattern"), how)


def covered(copied):
    def spoil(folder):
        row, column = on_board(folder, NAMES[7])

        def how(image):
            if copied:
                image[row - 150:row + 150, column - 200:column - 20] = image[row - 150:row + 150, column - 170:column + 10].copy()
            else:
                image[row - 150:row + 150, column - 200:column - 20] = 70
            return image
        change(folder, NAMES[7], ("pattern",), how)
    return spoil


def jpeg(folder):
    for name in NAMES:
        for picture in ("white", "pattern"):
            file = folder / name / f"{picture}.png"
            image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            file.unlink()
            cv2.imwrite(str(file.with_suffix(".jpg")), image, [cv2.IMWRITE_JPEG_QUALITY, 92])


def from_pose(first, how):
    def spoil(folder):
        for name in NAMES[first:]:
            change(folder, name, ("white", "pattern"), how)
    return spoil


def no_pictures(folder):
    (folder / NAMES[8] / "notes.txt").write_text("none", encoding="utf-8")
    (folder / NAMES[9] / "white.png").unlink()
    (folder / NAMES[9] / "white.png").write_text("no picture", encoding="utf-8")


def larger(percent):
    kind, size, *lengths = arguments.board.split(":")
    scaled = [one if one.startswith("DICT") else repr(float(one) * (1 + percent / 100)) for one in lengths]
    return ":".join([kind, size, *scaled])


def rows_by_columns():
    kind, size, *rest = arguments.board.split(":")
    return ":".join([kind, "x".join(reversed(size.split("x"))), *rest])


KEPT, NEW = "in force stays", "is replaced"
#       fault, how it is made, words that name it, what becomes of the calibration in force, and the board that is asked for
FAULTS = [
    ("none", lambda folder: None, (r"verdict: good",), NEW, None),
    ("patterns of two poses swapped", swap, (r"left out: its pattern picture belongs to another pose.*pose_06",), NEW, None),
    ("pattern moved by 9 px alone", lambda folder: change(folder, NAMES[3], ("pattern",), lambda image: np.roll(image, 9, 1)),
     (r"pose_03.*left out: the board's print moved by 9 px",), NEW, None),
    ("three poses, copied four times", copies, (r"shows the board in the same place as pose_00",), KEPT, None),
    ("the same with noise of their own", same_poses_anew, (r"shows the board in the same place as pose_00",), KEPT, None),
    ("4 times as bright: clipped", clipped(4), (r"pose_05.*left out:.*(full level|clipped)",), NEW, None),
    ("58 % of a board clipped by a reflection", burnt(0.58), (r"pose_05.*left out: clipped",), NEW, None),
    ("82 % of it", burnt(0.82), (r"pose_05.*clipped",), NEW, None),
    ("twice as bright", clipped(2), (r"pose_05.*full level",), NEW, None),
    ("a part of the pattern covered", covered(False), (r"covered: .* missing in one place",), NEW, None),
    ("a part of it copied from beside", covered(True), (r"covered: .* missing in one place",), NEW, None),
    ("camera turned 0.1 degrees about x from pose 8", from_pose(8, turned((1, 0, 0), .1)),
     (r"the rig moved during the session: .*camera.*pose_08",), KEPT, None),
    ("about y", from_pose(8, turned((0, 1, 0), .1)), (r"the rig moved during the session: .*pose_08",), KEPT, None),
    ("about z", from_pose(8, turned((0, 0, 1), .1)), (r"the rig moved during the session: .*camera.*pose_08",), KEPT, None),
    ("square 3 % too large", lambda folder: None, (r"measures .* mm for a board spacing of .* mm",), KEPT, larger(3)),
    ("rows by columns", lambda folder: None, (r"verdict: good",), NEW, rows_by_columns()),
    ("a pattern.png missing", lambda folder: (folder / NAMES[4] / "pattern.png").unlink(), (r"pose_04: .*lacks a projected image",), NEW, None),
    ("a pose of another size", lambda folder: change(folder, NAMES[0], ("white", "pattern"), lambda image: image[:, :1280]),
     (r"pose_00.*not used: its pictures have 1280x",), NEW, None),
    ("JPEG", jpeg, (r"warning: .* JPEG",), NEW, None),
    ("a file that is no picture", no_pictures, (r"pose_09.*white.png",), NEW, None),
]


def calibrate(folder, board, home):
    configuration = home / "slsd.toml"
    own = pathlib.Path(arguments.config).read_text(encoding="utf-8") if arguments.config else ""
    configuration.write_text(own + "\n[calibration]\nfile = 'calibration.yml'\n", encoding="utf-8")
    done = subprocess.run([arguments.program, "--config", configuration, "--calibrate", "--from", folder, "--board", board],
                          capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


failed = 0
with tempfile.TemporaryDirectory(prefix="slsd-faults-") as temporary:
    home = pathlib.Path(temporary)
    status, said = calibrate(arguments.session, arguments.board, home)
    if status != 0:
        sys.exit("the session without a fault is refused:\n" + said)
    in_force = (home / "calibration.yml").read_bytes()
    for name, spoil, words, becomes, board in FAULTS:
        if arguments.only not in name:
            continue
        folder = home / "session"
        shutil.rmtree(folder, ignore_errors=True)
        for pose in NAMES:
            shutil.copytree(arguments.session / pose, folder / pose, ignore=lambda _, files: [f for f in files if not f.endswith(".png")])
        spoil(folder)
        (home / "calibration.yml").write_bytes(in_force)
        status, said = calibrate(folder, board or arguments.board, home)
        kept = (home / "calibration.yml").read_bytes() == in_force
        ok = all(re.search(word, said) for word in words) and (status != 0 and kept) == (becomes == KEPT)
        failed += not ok
        print(f"{'ok    ' if ok else 'FAILED'} {name}: {'refused' if status else 'calibrated'}, that in force {'stays' if kept else 'replaced'}")
        told = [line for line in said.splitlines() if any(re.search(word, line) for word in words)] if ok else said.splitlines()
        for line in told[:3] if ok else [one for one in told if re.search(r"^\S*pose_|^plane_|slsd|warning|verdict|%", one)]:
            print("         " + line.strip())
        sys.stdout.flush()
sys.exit(1 if failed else 0)
