#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Decodes rendered frames and prints how large their errors are, and how large in units of sigma_mm.

A frame is a folder of the renderer with frame.png, calibration.yml and depth.npy (mm along z, NaN where nothing is). The
error of a point lies along the camera's ray, at the pixel where it appears; at a jump of the surface, against the side
that is nearer to it. Needs numpy."""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

EDGE_MM = 4.0  # what four neighbouring pixels may differ by on one surface, times four
GROSS_MM = 5.0
FIELDS = [(name, '<f4') for name in ('x', 'y', 'z')] + [('intensity', 'u1')]
FIELDS += [(name, '<f4') for name in ('u', 'v', 'projector_u', 'projector_v')]
FIELDS += [('camera', 'u1'), ('symbol', 'u1'), ('sigma', '<f4'), ('column', '<i4'), ('row', '<i4')]


def read_cloud(path):
    head, _, body = path.read_bytes().partition(b'end_header\n')
    count = next(int(line.split()[-1]) for line in head.split(b'\n') if line.startswith(b'element vertex'))
    return np.frombuffer(body, np.dtype(FIELDS), count)


def true_depth(depth, u, v, measured):
    """1/z is linear over a plane's image, so interpolating it is exact there."""
    height, width = depth.shape
    inside = (u >= 0) & (v >= 0) & (u <= width - 1) & (v <= height - 1)
    u, v = np.clip(u, 0, width - 1.001), np.clip(v, 0, height - 1.001)
    x, y = np.floor(u).astype(int), np.floor(v).astype(int)
    a, b = u - x, v - y
    around = np.stack([depth[y, x], depth[y, x + 1], depth[y + 1, x], depth[y + 1, x + 1]], 1).astype(float)
    weight = np.stack([(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b], 1)
    with np.errstate(invalid='ignore'):
        between = 1 / (weight / around).sum(1)
        near = around.max(1) - around.min(1) < 4 * EDGE_MM
        smooth = near & (np.abs(around[:, 0] + around[:, 3] - around[:, 1] - around[:, 2]) < 0.25 * EDGE_MM)
    candidates = np.concatenate([around, np.where(near, between, np.nan)[:, None]], 1)
    off = np.where(np.isfinite(candidates), np.abs(candidates - measured[:, None]), np.inf)
    nearest = candidates[np.arange(len(off)), off.argmin(1)]
    return np.where(inside, np.where(smooth, between, nearest), np.nan)


def errors_of(folder, cloud):
    depth = np.load(folder / 'depth.npy')
    u, v, z = (cloud[name].astype(float) for name in ('u', 'v', 'z'))
    along_ray = np.sqrt(sum(cloud[name].astype(float) ** 2 for name in ('x', 'y', 'z'))) / z
    return (z - true_depth(depth, u, v, z)) * along_ray


def decode(program, pattern, folder, fine):
    with tempfile.TemporaryDirectory() as home:
        cloud = pathlib.Path(home) / 'cloud.ply'
        subprocess.run([program, pattern, folder / 'calibration.yml', folder / 'frame.png', cloud] + ['--fine'] * fine,
                       check=True)
        return read_cloud(cloud)


def line(name, errors, sigma):
    known = np.isfinite(errors)
    unknown = np.sum(~known)  # where the truth has no surface
    errors, sigma = errors[known], sigma[known]
    ratio = errors / sigma
    within = np.abs(errors) <= GROSS_MM
    gross = np.sum(~within & (sigma < 1))
    print(f'| {name} | {known.size} | {ratio.std():.2f} | {1.4826 * np.median(np.abs(ratio)):.2f} '
          f'| {100 * np.mean(np.abs(ratio) > 3):.2f} | {np.sqrt(np.mean(errors[within] ** 2)):.3f} '
          f'| {np.median(np.abs(errors)):.3f} | {np.mean(errors[within]):+.3f} | {np.sum(~within)} | {gross} '
          f'| {unknown} |')
    return ratio.std()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('frames', type=pathlib.Path, nargs='+', help='folders of rendered frames, or one that holds such')
    parser.add_argument('--pattern', type=pathlib.Path, required=True, help='pattern file that was projected')
    parser.add_argument('--fine', action='store_true', help='with [decode] precision = "fine"')
    parser.add_argument('--program', type=pathlib.Path, default='build/release/bin/decode-frame')
    options = parser.parse_args()
    folders = []
    for path in options.frames:
        folders += [path] if (path / 'depth.npy').exists() else sorted(p.parent for p in path.glob('*/depth.npy'))
    if not folders:
        sys.exit('no depth.npy in ' + ' '.join(map(str, options.frames)))
    print('| scene | points | error / sigma: std | robust std | beyond 3, % | RMS mm | median mm | bias mm '
          f'| off > {GROSS_MM:.0f} mm | of these sigma < 1 mm | where nothing is |\n' + 11 * '|---' + '|')
    everything, deviations = [], []
    for folder in folders:
        cloud = decode(options.program, options.pattern, folder, options.fine)
        errors = errors_of(folder, cloud)
        everything.append((errors, cloud['sigma'].astype(float)))
        deviations.append(line(folder.name, *everything[-1]))
    line('all', *map(np.concatenate, zip(*everything)))
    good = sum(0.6 <= deviation <= 1.6 for deviation in deviations)
    print(f'\nstandard deviation of error / sigma from 0.6 to 1.6 in {good} of {len(folders)} scenes')


if __name__ == '__main__':
    main()
