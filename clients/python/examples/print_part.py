# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Makes a watertight STL of a part to print: turn the part by hand or on a table, and press Enter for each view.

    print_part.py part.stl 36

Turn by 15 degrees at most between two views; 36 views are a full turn in steps of ten degrees. The recorded views of a
turn-table are 60 degrees apart, so it names those that do not fit: slsd --config tests/clients/recorded/turn_table/slsd.toml
"""
import argparse

import slsd


def main(out, count, box):
    with slsd.Scanner() as scanner, slsd.Model(scanner) as model:
        for i in range(count):
            input(f"view {i + 1} of {count}: ")
            cloud = scanner.scan(density="pixels", coordinate_frame="rig", stride=1, voxel_mm=0, timeout_s=60)
            if len(cloud) == 0:
                print(f"no points, so this view is left out: {cloud.why_empty}")
                continue
            model.add(cloud)
        report = model.save(out, close=True, box=box)
    for frame in report["refused"]:
        print(f"left out: {frame['reason']}")
    print(f"{len(report['fused'])} views, {report['triangles']} triangles; {100 * report['invented_share']:.0f} % of the surface was not seen")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.stl")
    parser.add_argument("count", type=int, metavar="VIEWS")
    parser.add_argument("--box", type=float, nargs=6, metavar="MM", help="where the part is: least x y z, greatest x y z")
    options = parser.parse_args()
    if options.count < 2:
        parser.error("VIEWS must be 2 or more")
    try:
        main(options.out, options.count, options.box)
    except EOFError:
        parser.error("standard input ended before all views were there")
    except (slsd.ScannerError, OSError, ValueError) as error:
        parser.error(str(error))
