#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Renders an object that a hand turns before the paper's rig, in the layout of model_report.py. Needs the renderer, and an object:
its own bust, or one of turning_objects.py."""
import argparse
import functools
import json
import pathlib
import shutil
import sys

import numpy as np

FAR = {"rig.cam_size": (800, 640), "rig.cam_fov": 450.0}  # the paper's camera, cut to the object
NEAR = {"rig.wd": 600.0, "rig.cam_fov": 270.0, "rig.proj_w": 300.0, "rig.cam_size": (1600, 1200)}
FAR_MM, NEAR_MM, NEAR_SWAY = 2050.0, 640.0, 0.27
LOOKS = 3  # at different times of an exposure: the pattern moves by less than a pixel of the projector
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
    parser.add_argument("--exposure-ms", type=float, default=5, help="0: the object stands still in each frame")
    parser.add_argument("--rate", type=float, default=10, help="frames a second")
    given = parser.parse_args()
    sys.path.insert(0, str(given.renderer))
    json.dump = functools.partial(json.dump, default=str)  # scene.json takes no transform
    import cv2
    import render_scene
    import rendering.transport  # noqa: F401 (it sets Mitsuba's variant)
    from rendering import sensor
    from rendering.scenes import RX, RY, RZ, T, diffuse
    random = np.random.default_rng(given.seed)
    turn, phases = 360 / given.degrees, random.uniform(0, 2 * np.pi, (6, 2))

    def sway(which, most, at):
        """A hand's: slow and quick. @param at  in frames"""
        slow, quick = phases[which]
        return most * (0.7 * np.sin(2 * np.pi * at / (0.38 * turn) + slow) + 0.3 * np.sin(2 * np.pi * at / (0.15 * turn) + quick))

    def pose(at):
        rotation = RZ(sway(1, 3, at)) @ RX(sway(0, 4, at)) @ RY(given.degrees * at + sway(2, 1.5, at))
        reach = NEAR_SWAY if given.near else 1
        return rotation, np.array([reach * sway(3, 12, at), reach * sway(4, 8, at),
                                   reach * sway(5, 15, at) + (NEAR_MM if given.near else FAR_MM)])

    def render(at, folder, seed, samples, exposure, ground_truth):
        """@return the light on the sensor, 1 at its full level, and what scene.json says"""
        rotation, place = pose(at)
        shape = {"type": "ply", "filename": str(given.object.resolve()), "bsdf": diffuse(0.75),
                 "to_world": T(rotation, tuple(place), (1.0,) * 3)}
        overrides = {"shapes": {"object": shape}, **(NEAR if given.near else FAR)}
        told = render_scene.render(str(given.pattern.with_suffix(".png")), "bust", str(folder), seed=seed, spp=samples,
                                   exposure=exposure, extra=True, quiet=True, ground_truth=ground_truth, overrides=overrides)
        return np.load(folder / "frame_linear.npy"), told

    given.out.mkdir(parents=True, exist_ok=True)
    shutil.copy(given.object, given.out / "object.ply")
    shutil.copy(given.pattern, given.out / "pattern.toml")
    looks = LOOKS if given.exposure_ms > 0 else 1
    shares = (np.arange(looks) + 0.5) / looks - 0.5  # of the exposure, from its middle; the pose is that of the middle
    exposure = None
    for i in range(given.frames):
        folder, lights = given.out / f"{i:04d}", []
        for look, at in enumerate(i + shares * given.exposure_ms * given.rate / 1000):
            light, told = render(at, folder, 100 * given.seed + LOOKS * i + look, max(2, given.samples // looks), exposure,
                                 look == looks // 2)
            lights.append(light)
            exposure = told["exposure"]  # that of the first frame
        frame = sensor.develop(np.mean(lights, 0), 1, told["sensor"], np.random.default_rng([given.seed, i]))
        cv2.imwrite(str(folder / "frame.png"), frame)
        for path in folder.iterdir():
            if path.name not in KEPT:
                path.unlink()
        rotation, place = pose(i)
        np.savetxt(folder / "pose.txt", np.hstack([rotation, place[:, None]]))
        print(folder, flush=True)


if __name__ == "__main__":
    main()
