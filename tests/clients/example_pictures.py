#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Draws the pictures of docs/examples.md from recorded frames: example_pictures.py FOLDER. Needs matplotlib.

    SLSD_BIN=build/release/bin SLSD_SCENE=build/release/tests/daemon/scene tests/clients/example_pictures.py docs/examples
"""
import contextlib
import pathlib
import sys
import tempfile

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plot  # noqa: E402
import numpy as np  # noqa: E402

from examples_test import CELL, HERE, RECORDED, recorded, run_example  # noqa: E402
from seam import SCANNERS, placed, read_extrinsics, service, steps_at_seam  # noqa: E402
import drift  # noqa: E402
import gap  # noqa: E402
import pick  # noqa: E402
import slsd  # noqa: E402

plot.rcParams.update({"font.size": 8, "figure.dpi": 100, "image.cmap": "viridis"})
OUT = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "docs/examples")


def scan(source, density="pixels"):
    with source as running, slsd.Scanner(running.socket) as scanner:
        return scanner.scan(density=density, timeout_s=60).points


def keep(name, figure):
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / f"{name}.png", bbox_inches="tight", pad_inches=0.05)
    plot.close(figure)


def from_front(axes, points, colour=None, size=1.0, **more):
    shown = axes.scatter(points[:, 0], -points[:, 1], s=size, c=points[:, 2] if colour is None else colour, linewidths=0, **more)
    axes.set_aspect("equal")
    axes.set_xlabel("x, mm")
    return shown


def xyz(points, step=1):
    return np.stack([points[axis][::step] for axis in "xyz"], axis=1).astype(float)


def draw_pick():
    cloud = xyz(scan(service(CELL, "left", "scene")))
    point, normal, _ = pick.places(cloud, 80)[0]
    figure, axes = plot.subplots(figsize=(6, 4))
    figure.colorbar(from_front(axes, cloud[::5]), label="z, mm")
    axes.add_patch(plot.Circle((point[0], -point[1]), 40, fill=False, color="red", linewidth=2))
    axes.plot(point[0], -point[1], "r+", markersize=12)
    axes.set_title(f"the cup goes to ({point[0]:.1f}, {point[1]:.1f}, {point[2]:.1f}) mm")
    keep("pick", figure)


def draw_gap():
    points = scan(recorded(RECORDED / "gap"))
    behind, before = (160, 110, 240, 230), (98, 148, 142, 192)
    found, sigma = gap.gap(points, behind, before)
    figure, (front, side) = plot.subplots(1, 2, figsize=(8, 3.2), gridspec_kw={"width_ratios": [1.6, 1], "wspace": 0.35})
    near = (points["z"] > 2140) & (points["z"] < 2185)
    figure.colorbar(from_front(front, xyz(points[near], 3), size=2), label="z, mm", ax=front)
    for (x0, y0, x1, y1), colour in ((behind, "white"), (before, "red")):
        front.add_patch(plot.Rectangle((x0, -y1), x1 - x0, y1 - y0, fill=False, color=colour, linewidth=1.5))
    row = points[near & (np.abs(points["y"] - 170) < 3)]
    side.plot(row["x"], row["z"], ".", markersize=2)
    side.invert_yaxis()
    side.set_xlabel("x, mm")
    side.set_ylabel("z, mm, at y = 170")
    figure.suptitle(f"gap {found:.2f} mm, one standard deviation {sigma:.2f} (true: 15.00)")
    keep("gap", figure)


def draw_conveyor():
    points = scan(service(CELL, "left", "scene"), "symbols")
    figure, axes = plot.subplots(1, 3, figsize=(8, 2.3), sharey=True)
    for i, axis in enumerate(axes):
        from_front(axis, xyz(points), size=3)
        axis.set_title(f"part-{i:06}.npy, {len(points)} points")
    keep("conveyor", figure)


def draw_turn_table():
    with tempfile.TemporaryDirectory() as folder, recorded(RECORDED / "turn_table") as running:
        one = slsd.Scanner(running.socket).scan(timeout_s=60).points
        file = pathlib.Path(folder) / "all.npy"
    with tempfile.TemporaryDirectory() as folder, recorded(RECORDED / "turn_table") as running:
        file = pathlib.Path(folder) / "all.npy"
        run_example(running, "turn_table.py", file, 6, "0,0,2010", "0,1,0", text="\n" * 6)
        merged = np.load(file)
    figure, axes = plot.subplots(1, 4, figsize=(8, 2.8), sharey=True)
    from_front(axes[0], xyz(one), size=0.6)
    axes[0].set_title("one view")
    for axis, degrees in zip(axes[1:], (0, 90, 180)):
        turn = np.radians(degrees)
        about = (merged - (0, 0, 2010)) @ np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
        seen = about[about[:, 2] < 0][::3]
        from_front(axis, seen, size=0.6)
        axis.set_title(f"six in one, from {degrees} degrees")
    keep("turn_table", figure)


def draw_drift():
    with contextlib.ExitStack() as stack:
        folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        with recorded(RECORDED / "gap") as running, slsd.Scanner(running.socket) as scanner:
            image = scanner.frame().image.astype(float)
        draw = np.random.default_rng(1)
        for i, px in enumerate(0.3 * (1 - np.exp(-np.arange(24) / 6))):  # as it warms up
            moved = image + px * (np.roll(image, 1, axis=1) - image) + draw.normal(0, 1, image.shape)
            (folder / f"{i:02}.pgm").write_bytes(b"P5 %d %d 255\n" % image.shape[::-1] + np.clip(moved.round(), 0, 255).astype(np.uint8).tobytes())
        from examples_test import CONFIGURATION, RECORDED, Service
        running = stack.enter_context(Service(configuration=CONFIGURATION.format(
            source=HERE.parents[1], frames=folder, calibration=RECORDED / "gap/calibration.yml")))
        run_example(running, "drift.py", folder / "day.csv", 0.1, 24)
        rows = np.genfromtxt(folder / "day.csv", delimiter=",", skip_header=1, usecols=range(3, 12))
        found = drift.look(folder / "day.csv")
    figure, axes = plot.subplots(figsize=(6, 3))
    for i in range(9):
        axes.plot(rows[:, i] - rows[0, i], label=f"part {i}: {found[i][0]:+.2f} mm")
    axes.set_xlabel("scan")
    axes.set_ylabel("median depth less the first, mm")
    axes.legend(fontsize=6, ncol=2)
    keep("drift", figure)


def draw_open3d():
    try:
        import open3d
    except ImportError:
        print("open3d.png is not drawn: no Open3D (pip install open3d-cpu)")
        return
    with service(CELL, "left", "scene") as running, tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "cloud.ply"
        run_example(running, "to_open3d.py", file, python=sys.executable)
        cloud = open3d.io.read_point_cloud(str(file))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=60, max_nn=12))
    cloud.orient_normals_towards_camera_location()
    points, normals = np.asarray(cloud.points), np.asarray(cloud.normals)
    figure, axes = plot.subplots(figsize=(6, 4))
    from_front(axes, points, np.clip(normals * (0.5, 0.5, -0.5) + 0.5, 0, 1), 6)
    axes.set_title(f"{len(points)} points in Open3D, coloured by its normals")
    keep("open3d", figure)


def draw_live_view():
    points = scan(service(CELL, "left", "scene"), "symbols")
    figure = plot.figure(figsize=(5, 3.6))
    axes = figure.add_subplot()
    axes.scatter(points["x"], -points["y"], s=2, c=points["z"])  # as the example does
    keep("live_view", figure)


def draw_cell():
    clouds = [xyz(scan(service(CELL, name, "scene"))) for name in SCANNERS]
    clouds[1] = placed(clouds[1], read_extrinsics(CELL / "truth.toml", "right"))
    steps = steps_at_seam(*clouds)
    figure, axes = plot.subplots(figsize=(6, 4))
    for cloud, colour in zip(clouds, ("tab:blue", "tab:orange")):
        from_front(axes, cloud[::4], colour, 0.4, alpha=0.5)
    axes.set_title(f"two scanners in one frame; mean step at the seam {steps.mean():+.3f} mm")
    keep("merged", figure)


if __name__ == "__main__":
    for draw_one in (draw_pick, draw_gap, draw_conveyor, draw_turn_table, draw_drift, draw_open3d, draw_live_view, draw_cell):
        draw_one()
