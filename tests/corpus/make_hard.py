#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Makes of a rendered scene what makes it hard to read: light on the object alone, blur, saturation, gamma."""
import argparse
import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

AMBIENT = 120 / 255  # on the object alone, of a saturated pixel
BLUR_PX = 3.0
SATURATED = 0.3  # of the pixels that see the object


def develop(light, sensor, seed, gamma=1.0):
    """A frame of linear light, 1 where a pixel is saturated."""
    random = np.random.default_rng(seed)
    full, black = sensor['full_scale_e'], sensor['black_level_dn']
    electrons = random.poisson(np.clip(light, 0, 100) * full) + sensor['read_noise_e'] * random.standard_normal(light.shape)
    share = np.clip(electrons / full, 0, 1) ** (1 / gamma)
    return np.clip(np.rint(black + share * (255 - black)), 0, 255).astype(np.uint8)


def of_the_object(rendered):
    """Where the object is: all that is seen, but for a wall behind it."""
    depth = np.load(rendered / 'depth.npy')
    seen = np.isfinite(depth)
    if seen.mean() < 0.9:
        return seen
    back = np.nanpercentile(depth, 95)
    return seen & (depth < back - 100)


def variants(rendered):
    """Name and frame of each."""
    scene = json.loads((rendered / 'scene.json').read_text())
    sensor = scene['sensor']
    pattern = np.load(rendered / 'frame_linear.npy').astype(float)
    white = np.load(rendered / 'white_linear.npy').astype(float)
    seed = scene['seed']
    seen = of_the_object(rendered)
    lit = 0.5 * pattern + AMBIENT * seen  # half the light, so that nothing saturates
    yield 'plain', develop(pattern, sensor, seed), develop(white, sensor, seed + 1)
    yield 'lit_object', develop(lit, sensor, seed), None
    yield 'blur_2', develop(cv2.GaussianBlur(pattern, (0, 0), 2), sensor, seed), None
    yield 'blur_3', develop(cv2.GaussianBlur(pattern, (0, 0), BLUR_PX), sensor, seed), None
    yield 'saturated', develop(pattern / np.quantile(pattern[seen], 1 - SATURATED), sensor, seed), None
    yield 'gamma', develop(pattern, sensor, seed, 2.2), None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('rendered', type=pathlib.Path, help='folder that the renderer wrote, with --extra')
    parser.add_argument('--pattern', type=pathlib.Path, required=True, help='pattern file that was projected')
    parser.add_argument('--to', type=pathlib.Path, required=True, help='folder for a folder of each kind')
    options = parser.parse_args()
    options.to.mkdir(parents=True, exist_ok=True)
    plain = options.to / 'plain'
    make_truth = pathlib.Path(__file__).with_name('make_truth.py')
    subprocess.run([sys.executable, make_truth, options.rendered, '--pattern', options.pattern, '--to', plain], check=True)
    for name, frame, white in variants(options.rendered):
        folder = options.to / name
        folder.mkdir(exist_ok=True)
        for shared in ('calibration.yml', 'truth.csv', 'pattern.toml'):
            if folder != plain:
                (folder / shared).unlink(missing_ok=True)
                (folder / shared).symlink_to(pathlib.Path('..') / 'plain' / shared)
        cv2.imwrite(str(folder / 'frame.png'), frame)
        if white is not None:
            (folder / 'white').mkdir(exist_ok=True)
            cv2.imwrite(str(folder / 'white' / 'frame.png'), white)


if __name__ == '__main__':
    main()
