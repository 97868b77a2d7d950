# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans every part on a conveyor, triggered by a light barrier.

CHIP and LINE name a GPIO line, such as "/dev/gpiochip0" 17. Each rising edge means a part (needs libgpiod's package gpiod).
Without them, each line of standard input means a part. Any recorded frame will do:
slsd --config tests/clients/recorded/gap/slsd.toml, with SLSD_SOCKET=/tmp/slsd-example.sock
"""
import argparse
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


def main(folder, chip, line):
    with slsd.Scanner() as scanner:
        for part, _ in enumerate(edges(chip, line) if chip else sys.stdin):
            try:
                cloud = scanner.scan(timeout_s=1)
            except slsd.ConnectionLost:
                raise
            except slsd.ScannerError as error:  # this part is lost; the next one comes
                print(f"part {part}: {error.name}: {error}", file=sys.stderr)
                continue
            np.save(folder / f"part-{part:06}.npy", cloud.points)
            print(f"part {part}: {len(cloud)} points", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, metavar="FOLDER", help="where the points go")
    parser.add_argument("chip", nargs="?", metavar="CHIP")
    parser.add_argument("line", nargs="?", type=int, metavar="LINE")
    options = parser.parse_args()
    if options.chip and options.line is None:
        parser.error("CHIP needs the number of a LINE")
    if not options.folder.is_dir():
        parser.error(f"{options.folder} is no folder")
    try:
        main(options.folder, options.chip, options.line)
    except slsd.ScannerError as error:
        parser.error(str(error))
