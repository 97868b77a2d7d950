#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Makes a scene of the corpus of what the renderer wrote: frame, calibration, sparse truth, and how it was made."""
import argparse
import json
import os
import pathlib
import re
import tomllib

import cv2
import numpy as np

WHOLE = 0.95  # share of a symbol that both devices have to see
RESOLVABLE_PX = 8.0  # its size in the camera along the direction most compressed
SMOOTH_MM = 0.5  # greatest departure of the surface from a plane around a symbol's middle
HEADER = 'column,row,left,top,right,bottom,camera_u,camera_v,z_mm,dz_du_mm_px,dz_dv_mm_px,resolvable'


def read_pattern(path):
    pattern = tomllib.loads(path.read_text())
    return (pattern['pattern']['symbol_size_px'], pattern['pattern']['spacing_px'],
            pattern['projector']['width_px'], pattern['projector']['height_px'])


def bilinear(image, u, v):
    x, y = int(np.floor(u)), int(np.floor(v))
    a, b = u - x, v - y
    return ((1 - a) * (1 - b) * image[y, x] + a * (1 - b) * image[y, x + 1] +
            (1 - a) * b * image[y + 1, x] + a * b * image[y + 1, x + 1])


def least_stretch(camera_uv, u, v, half):
    """Camera pixels per projector pixel along the direction most compressed; 0 where it cannot be told."""
    u, v = int(round(u)), int(round(v))
    if not (half <= u < camera_uv.shape[1] - half and half <= v < camera_uv.shape[0] - half):
        return 0.0
    jacobian = np.stack([camera_uv[v, u + half] - camera_uv[v, u - half],
                         camera_uv[v + half, u] - camera_uv[v - half, u]], 1) / (2.0 * half)
    return np.linalg.svd(jacobian, compute_uv=False)[1] if np.isfinite(jacobian).all() else 0.0


def depth_around(depth, u, v, radius=3):
    """Depth at a camera pixel and its gradient, from a plane through the pixels around it: there 1/z is linear in u and
    v. None at a jump of the surface."""
    x, y = int(round(u)), int(round(v))
    patch = depth[max(y - radius, 0):y + radius + 1, max(x - radius, 0):x + radius + 1].astype(float)
    if patch.shape != (2 * radius + 1,) * 2 or not np.isfinite(patch).all():
        return None
    dv, du = np.mgrid[-radius:radius + 1, -radius:radius + 1]
    terms = np.stack([np.ones(du.size), (du - (u - x)).ravel(), (dv - (v - y)).ravel()], 1)
    plane, *_ = np.linalg.lstsq(terms, 1 / patch.ravel(), rcond=None)
    if np.abs(1 / (terms @ plane) - patch.ravel()).max() > SMOOTH_MM:
        return None
    z = 1 / bilinear(1 / depth.astype(float), u, v)
    return z, -plane[1] * z * z, -plane[2] * z * z


def cell_line(column, row, camera_uv, depth, size, spacing):
    """The line of a cell, None where nothing of its symbol is seen."""
    pitch = size + spacing
    left, top = column * pitch + spacing // 2, row * pitch + spacing // 2
    seen = camera_uv[top:top + size, left:left + size].reshape(-1, 2)
    seen = seen[np.isfinite(seen[:, 0])]
    if not len(seen):
        return None
    box = [*np.floor(seen.min(0)), *np.ceil(seen.max(0))]
    u, v = left + (size - 1) / 2, top + (size - 1) / 2
    middle = bilinear(camera_uv, u, v)
    stretch = least_stretch(camera_uv, u, v, size // 2 - 2)
    whole = len(seen) >= WHOLE * size * size and np.isfinite(middle).all()
    around = depth_around(depth, *middle) if whole else None
    fields = [column, row, *(int(b) for b in box)]
    fields += [f'{c:.3f}' for c in middle] if whole else ['', '']
    fields += [f'{around[0]:.3f}', f'{around[1]:.4f}', f'{around[2]:.4f}'] if around else ['', '', '']
    return ','.join(map(str, fields + [int(whole and stretch * size >= RESOLVABLE_PX)]))


def cut(window, frame, camera_uv, depth, calibration):
    """The window's part of everything. The principal point moves with it."""
    x, y, width, height = window
    camera_uv = camera_uv - [x, y]
    with np.errstate(invalid='ignore'):
        inside = ((camera_uv >= -0.5) & (camera_uv < [width - 0.5, height - 0.5])).all(-1)
    camera_uv[~inside] = np.nan
    part = np.s_[y:y + height, x:x + width]
    return frame[part], camera_uv, depth[part], move_camera(calibration, window)


def move_camera(calibration, window):
    x, y, width, height = window
    calibration = re.sub(r'(\n +width:) \d+', rf'\1 {width}', calibration)
    calibration = re.sub(r'(\n +height:) \d+', rf'\1 {height}', calibration)

    def move(match):
        matrix = np.array([float(n) for n in match[2].split(',')])
        matrix[2] -= x
        matrix[5] -= y
        return match[1] + ', '.join(repr(float(n)) for n in matrix.round(9)) + match[3]
    return re.sub(r'(camera_matrix:.*?data: \[ )(.*?)( \])', move, calibration, flags=re.S)


def encode_png(image):
    """The smallest of what the encoder's strategies give."""
    level = [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY]
    strategies = [cv2.IMWRITE_PNG_STRATEGY_DEFAULT, cv2.IMWRITE_PNG_STRATEGY_FILTERED,
                  cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY]
    return min((cv2.imencode('.png', image, level + [s])[1].tobytes() for s in strategies), key=len)


def story(scene, light, pattern, window):
    settings = ''.join(f' --set {key}={json.dumps(value, separators=(",", ":"))}'
                       for key, value in scene['overrides'].items())
    lighting = f'light.py DARK {light["profile"]} OUT --seed {light["seed"]}\n' if light else ''
    cutting = f' --window {" ".join(map(str, window))}' if window else ''
    return (f'scene: {scene["scene"]}\n{scene["difficulty"]}\npattern: {pattern.stem}\nseed: {scene["seed"]}\n'
            f'jitter: {scene["jitter"]}\n\n'
            f'render_scene.py --pattern {pattern.stem}.png --scene {scene["scene"]} --seed {scene["seed"]} '
            f'--jitter {scene["jitter"]}{settings}{" --extra" if light else ""} --out {"DARK" if light else "OUT"}\n'
            f'{lighting}make_truth.py OUT --pattern config/patterns/{pattern.name} --to SCENE{cutting}\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('rendered', type=pathlib.Path, help='folder that the renderer wrote')
    parser.add_argument('--pattern', type=pathlib.Path, required=True, help='pattern file that was projected')
    parser.add_argument('--to', type=pathlib.Path, required=True, help="the scene's folder, beside this program")
    parser.add_argument('--window', type=int, nargs=4, metavar=('X', 'Y', 'WIDTH', 'HEIGHT'), help='keep this part')
    options = parser.parse_args()

    scene = json.loads((options.rendered / 'scene.json').read_text())
    frame = cv2.imread(str(options.rendered / 'frame.png'), cv2.IMREAD_GRAYSCALE)
    camera_uv = np.load(options.rendered / 'cam_uv.npy').astype(float)
    depth = np.load(options.rendered / 'depth.npy')
    calibration = (options.rendered / 'calibration.yml').read_text()
    if options.window:
        frame, camera_uv, depth, calibration = cut(options.window, frame, camera_uv, depth, calibration)

    size, spacing, width, height = read_pattern(options.pattern)
    pitch = size + spacing
    lines = [cell_line(column, row, camera_uv, depth, size, spacing)
             for row in range((height - spacing // 2 - size) // pitch + 1)
             for column in range((width - spacing // 2 - size) // pitch + 1)]
    options.to.mkdir(exist_ok=True)
    (options.to / 'frame.png').write_bytes(encode_png(frame))
    (options.to / 'calibration.yml').write_text(calibration)
    (options.to / 'truth.csv').write_text('\n'.join([HEADER] + [line for line in lines if line]) + '\n')
    lit = options.rendered / 'light.json'
    light = json.loads(lit.read_text()) if lit.exists() else None
    (options.to / 'scene.txt').write_text(story(scene, light, options.pattern, options.window))
    link = options.to / 'pattern.toml'
    link.unlink(missing_ok=True)
    link.symlink_to(os.path.relpath(options.pattern, options.to))


if __name__ == '__main__':
    main()
