#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""No include runs upward. The libraries that a room links refuse what is compiled; headers alone are seen only here."""
import pathlib
import re
import sys
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BELOW = {
    "core": {"core"},
    "picture": {"core", "picture"},
    "drivers": {"core", "drivers"},
    "configuration": {"configuration"},
    "rpc": {"rpc"},
    "scan": {"configuration", "scan"},
    "server": {"configuration", "scan", "rpc", "server"},
    "recording": {"recording"},
    "bundle": {"configuration", "scan", "rpc", "server", "recording", "bundle"},
    "service": {"configuration", "scan", "rpc", "server", "bundle", "service"},
    "client": {"rpc", "recording", "client"},
    "latency": {"configuration", "latency"},
    "calibrate": {"configuration", "scan", "latency", "rpc", "client", "calibrate"},
    "commands": {"configuration", "scan", "rpc", "server", "recording", "bundle", "client", "latency",
                 "commands"},
}


def room_of(path):
    parts = pathlib.PurePath(path).parts
    return parts[1] if parts[0] == "daemon" else parts[0]


class Rooms(unittest.TestCase):
    def test_no_include_runs_upward(self):
        upward = []
        for top in ("core", "picture", "drivers", "daemon"):
            for file in sorted((SOURCE / top).rglob("*.[ch]pp")):
                room = room_of(file.relative_to(SOURCE))
                if room not in BELOW:
                    continue  # slsd.cpp and slsctl.cpp put the rooms together
                below = BELOW[room] | ({"core", "picture", "drivers"} if top == "daemon" else set())
                for included in re.findall(r'^#include "([^"]+)"', file.read_text(encoding="utf-8"), re.M):
                    if room_of(included) not in below:
                        upward.append(f"{file.relative_to(SOURCE)} includes {included}")
        self.assertEqual(upward, [])

    def test_every_room_has_its_place(self):
        rooms = {folder.name for folder in (SOURCE / "daemon").iterdir() if folder.is_dir()}
        self.assertEqual(rooms, BELOW.keys() - {"core", "picture", "drivers"})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
