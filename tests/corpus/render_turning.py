#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Renders an object that a hand turns before the paper's rig, in the layout of model_report.py. Needs the renderer."""
import argparse
import pathlib
import shutil
import sys

import numpy as np

FAR = {"rig.cam_size": (800, 640), "rig.cam_fov": 450.0}  # the paper's camera, cut to the object
NEAR = {"rig.wd": 600.0, "rig.cam_fov": 270.0, "rig.proj_w": 300.0, "rig.cam_size": (1600, 1200)}
FAR_MM, NEAR_MM, NEAR_SWAY = 2050.0, 640.0, 0.27
KEPT = ("frame.png", "calibration.yml", "depth.npy", "mask.npy")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("renderer", help="the folder of render_scene.py", type=pathlib.Path)
    parser.add_argument("pattern", help="FILE.toml beside FILE.png, as slsd --pattern writes it", type=pathlib.Path)
    parser.add_argument("object", help="the mesh, mm, PLY", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--degrees", type=float, default=6.0, help="from one frame to the next")
    parser.add_argument("--near", action="store_true", help="at 0.6 m; else at 2 m")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--samples", type=int, default=18, help="per pixel; 8 is twice as fast and has more grain")
    given = parser.parse_args()
    sys.path.insert(0, str(given.renderer))
    import render_scene
    import rendering.transport  # noqa: F401 (it sets Mitsuba's variant)
    from rendering.scenes import RX, RY, RZ, T, diffuse
    random, time = np.random.default_rng(given.seed), np.arange(given.frames)

    def sway(most):
        """A hand's: slow and quick."""
        turn, first, second = 360 / given.degrees, *random.uniform(0, 2 * np.pi, 2)
        return most * (0.7 * np.sin(2 * np.pi * time / (0.38 * turn) + first)
                       + 0.3 * np.sin(2 * np.pi * time / (0.15 * turn) + second))

    tilt, roll, turn = sway(4), sway(3), given.degrees * time + sway(1.5)
    places = np.stack([sway(12), sway(8), sway(15)], 1) * (NEAR_SWAY if given.near else 1)
    places[:, 2] += NEAR_MM if given.near else FAR_MM
    given.out.mkdir(parents=True, exist_ok=True)
    shutil.copy(given.object, given.out / "object.ply")
    shutil.copy(given.pattern, given.out / "pattern.toml")
    for i in time:
        folder, rotation = given.out / f"{i:04d}", RZ(roll[i]) @ RX(tilt[i]) @ RY(turn[i])
        shape = {"type": "ply", "filename": str(given.object.resolve()), "bsdf": diffuse(0.75),
                 "to_world": T(rotation, tuple(places[i]), (1.0,) * 3)}
        try:
            render_scene.render(str(given.pattern.with_suffix(".png")), "bust", str(folder), seed=100 * given.seed + int(i),
                                spp=given.samples, quiet=True,
                                overrides={"shapes": {"object": shape}, **(NEAR if given.near else FAR)})
        except TypeError as error:  # the last step: scene.json cannot hold the shape's place
            if not (folder / "depth.npy").exists():
                raise error
        for path in folder.iterdir():
            if path.name not in KEPT:
                path.unlink()
        np.savetxt(folder / "pose.txt", np.hstack([rotation, places[i][:, None]]))
        print(folder, flush=True)


if __name__ == "__main__":
    main()
