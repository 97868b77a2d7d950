# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A scan of every part on a conveyor, when a light barrier says that it is there: conveyor.py FOLDER [CHIP LINE]

CHIP and LINE name a GPIO line whose rising edge is a part ("/dev/gpiochip0" 17; needs libgpiod's package gpiod). Without
them each line of standard input is one.
"""
import datetime
import pathlib
import sys

import numpy as np

import slsd


def edges(chip, line):
    import gpiod
    wanted = gpiod.LineSettings(edge_detection=gpiod.line.Edge.RISING, debounce_period=datetime.timedelta(milliseconds=5))
    with gpiod.request_lines(chip, config={line: wanted}) as request:
        while True:
            yield from request.read_edge_events()


def main(folder, *pin):
    with slsd.Scanner() as scanner:
        for part, _ in enumerate(edges(pin[0], int(pin[1])) if pin else sys.stdin):
            try:
                cloud = scanner.scan(timeout_s=1)
            except slsd.ConnectionLost:
                raise
            except slsd.ScannerError as error:  # this part is lost; the next one comes
                print(f"part {part}: {error.name}: {error}", file=sys.stderr)
                continue
            np.save(pathlib.Path(folder) / f"part-{part:06}.npy", cloud.points)
            print(f"part {part}: {len(cloud)} points", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
