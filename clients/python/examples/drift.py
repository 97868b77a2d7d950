# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Records for a day, and looks for drift: drift.py FILE.csv [EVERY_S [SCANS]], then drift.py FILE.csv look

Put something that stands still in view. Every EVERY_S seconds (600) the program writes a line with the median depth of each ninth of the
picture, until SCANS (144) are done. `look` fits each ninth's change over time. Any recorded frame will do, but shows no drift:
slsd --config tests/clients/recorded/gap/slsd.toml, with SLSD_SOCKET=/tmp/slsd-example.sock
"""
import argparse
import csv
import datetime
import sys
import time

import numpy as np

import slsd

PARTS = 3
LEAST_MM = 0.001  # a smaller change is no drift, however certain
COLUMNS = ["time", "scan", "points", *(f"z{i}_mm" for i in range(PARTS**2))]


def depths(points):
    """Median depth of each part of the picture, NaN where there are fewer than ten points."""
    edges = [np.quantile(points[axis], np.linspace(0, 1, PARTS + 1)[1:-1]) for axis in ("x", "y")]
    part = np.searchsorted(edges[0], points["x"]) + PARTS * np.searchsorted(edges[1], points["y"])
    return [float(np.median(points["z"][part == i])) if (part == i).sum() >= 10 else float("nan") for i in range(PARTS**2)]


def record(file, every_s=600.0, scans=144):
    done = 0
    slsd.Scanner().close()  # fails at once if there is no service
    with open(file, "a", newline="", encoding="utf-8") as out:
        lines = csv.writer(out)
        if out.tell() == 0:
            lines.writerow(COLUMNS)
        due = time.monotonic()
        while done < scans:
            try:
                with slsd.Scanner() as scanner:
                    cloud = scanner.scan(timeout_s=30)
                lines.writerow([cloud.description["time"], cloud.description["scan"], len(cloud), *depths(cloud.points)])
                out.flush()  # keeps each line, because a day is long
                done += 1
            except slsd.ScannerError as error:  # a night's restart costs a line, not the day
                print(f"{error.name}: {error}", file=sys.stderr)
            due += every_s
            time.sleep(max(0.0, due - time.monotonic()))


def look(file):
    """For each part of the picture: how far it moved, mm, one standard deviation of that, and the scatter about the line."""
    with open(file, newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    if len(rows) < 4:
        raise ValueError(f"{len(rows)} scans are too few to tell drift from noise: four at least")
    at = [datetime.datetime.fromisoformat(row["time"].replace("Z", "+00:00")).timestamp() for row in rows]
    whole = np.array(at) - at[0]
    found = []
    for i in range(PARTS**2):
        z = np.array([float(row[f"z{i}_mm"]) for row in rows])
        seen = np.isfinite(z)
        if seen.sum() < 4:
            found.append((float("nan"),) * 3)
            continue
        share = whole[seen] / whole[-1]
        (slope, _), residuals, *_ = np.polyfit(share, z[seen], 1, full=True)
        scatter = np.sqrt(residuals[0] / (seen.sum() - 2)) if len(residuals) else 0.0
        found.append((slope, scatter / np.sqrt(((share - share.mean())**2).sum()), scatter))
    return found


def main(file, every, scans):
    if every != "look":
        record(file, every, scans)
        return
    found = np.array(look(file))
    for i, (moved, sigma, scatter) in enumerate(found):
        says = "drift" if abs(moved) > max(4 * sigma, LEAST_MM) else "none" if np.isfinite(moved) else "not seen"
        print(f"part {i}: {moved:+.3f} mm over the record, one standard deviation {sigma:.3f}, scatter {scatter:.3f}: {says}")


def seconds(word):
    return word if word == "look" else float(word)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE.csv", help="the record, which goes on if it is there")
    parser.add_argument("every", nargs="?", type=seconds, default=600.0, metavar="EVERY_S|look")
    parser.add_argument("scans", nargs="?", type=int, default=144, metavar="SCANS")
    options = parser.parse_args()
    try:
        main(options.file, options.every, options.scans)
    except (slsd.ScannerError, OSError, ValueError) as error:
        parser.error(str(error))
