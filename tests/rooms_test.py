#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""No include runs upward, and no room is too full.

The libraries that a room links refuse what is compiled; headers alone are seen only here.
"""
import collections
import pathlib
import re
import sys
import unittest

SOURCES_MOST = 24  # in a folder: above that, it has rooms of its own
SOURCE = pathlib.Path(__file__).resolve().parents[1]
TOPS = ("core", "picture", "drivers", "rpc", "daemon", "clients", "programs")
INCLUDE_FOLDERS = (SOURCE, SOURCE / "clients/cpp/include")
BASE = {"core", "picture", "drivers"}
PROTOCOL = {"rpc"}  # all that a client knows of the service
BELOW = {
    "core": set(),
    "picture": {"core"},
    "drivers": {"core"},
    "rpc": {"core"},
    "daemon/configuration": BASE,
    "daemon/scan": BASE | {"daemon/configuration"},
    "daemon/server": BASE | PROTOCOL | {"daemon/configuration", "daemon/scan"},
    "daemon/bundle": BASE | PROTOCOL | {"daemon/configuration", "daemon/scan", "daemon/server"},
    "daemon/service": BASE | PROTOCOL | {"daemon/configuration", "daemon/scan", "daemon/server", "daemon/bundle"},
    "clients/cpp": set(),
    "clients/usage": {"core"},
    "clients/connection": BASE | PROTOCOL | {"clients/cpp"},
    "clients/slsctl": BASE | PROTOCOL | {"clients/cpp", "clients/usage", "clients/connection"},
    "clients/access": BASE,
    "clients/web": BASE | PROTOCOL | {"clients/cpp", "clients/usage", "clients/access", "clients/connection",
                                      "clients/slsctl"},
    "clients/tcp": BASE | PROTOCOL | {"clients/cpp", "clients/usage", "clients/access"},
    "clients/model": BASE | PROTOCOL | {"clients/cpp", "clients/usage", "clients/connection"},
    "clients/dds": BASE | {"clients/cpp", "clients/usage"},
    "programs/latency": BASE | {"daemon/configuration"},
    "programs/calibrate": BASE | PROTOCOL | {"daemon/configuration", "daemon/scan", "clients/cpp",
                                             "clients/connection", "programs/latency"},
    "programs/hand_eye": BASE | {"clients/usage", "daemon/configuration", "daemon/scan", "programs/calibrate"},
    "programs/datasheet": BASE | PROTOCOL | {"clients/usage", "clients/cpp", "clients/connection"},
    "programs/verify": BASE | {"daemon/configuration", "daemon/scan", "programs/calibrate"},
    "programs/commands": BASE | PROTOCOL | {"daemon/configuration", "daemon/scan", "daemon/server", "daemon/bundle",
                                            "clients/connection", "programs/latency"},
}


def room_of(file):
    parts = file.relative_to(SOURCE).parts
    return parts[0] if parts[0] in BASE else "/".join(parts[:-1][:2])


def sources():
    return [file for top in TOPS for file in sorted((SOURCE / top).rglob("*.[ch]pp"))]


def includes_of(file):
    """The files of this project that a file includes."""
    for name in re.findall(r'^#include ["<]([^">]+)[">]', file.read_text(encoding="utf-8"), re.M):
        found = next((folder / name for folder in (*INCLUDE_FOLDERS, file.parent) if (folder / name).exists()), None)
        if found is not None:
            yield found


def circles(graph):
    """Groups of nodes that each reach all others of their group (Tarjan 1972)."""
    number, low, stack, found = {}, {}, [], []

    def visit(node):
        number[node] = low[node] = len(number)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in number:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == number[node]:
            at = stack.index(node)
            group = stack[at:]
            del stack[at:]
            if len(group) > 1:
                found.append(sorted(group))

    for node in graph:
        if node not in number:
            visit(node)
    return found


def graph_by(name_of):
    graph = {}
    for file in sources():
        name = name_of(file)
        graph.setdefault(name, set()).update(name_of(included) for included in includes_of(file))
        graph[name].discard(name)
    return graph


class Rooms(unittest.TestCase):
    def test_no_include_runs_upward(self):
        upward = []
        for file in sources():
            room = room_of(file)
            if room == "programs":
                continue  # slsd.cpp and its like put the rooms together
            below = BELOW.get(room, set()) | {room}
            upward += [f"{file.relative_to(SOURCE)} includes {included.relative_to(SOURCE)}"
                       for included in includes_of(file) if room_of(included) not in below]
        self.assertEqual(upward, [])

    def test_every_room_has_its_place(self):
        self.assertEqual({room_of(file) for file in sources()} - {"programs"}, set(BELOW))

    def test_no_room_is_too_full(self):
        count = collections.Counter(str(file.parent.relative_to(SOURCE)) for file in sources())
        self.assertEqual({room: number for room, number in count.items() if number > SOURCES_MOST}, {})

    def test_no_loop_between_top_rooms(self):
        self.assertEqual(circles(graph_by(lambda file: file.relative_to(SOURCE).parts[0])), [])

    def test_no_circle_within_a_room(self):
        """A header and the source of its name count as one: both say what the one depends on."""
        self.assertEqual(circles(graph_by(lambda file: str(file.relative_to(SOURCE).with_suffix("")))), [])


class Circles(unittest.TestCase):
    def test_finds_a_circle_and_no_other(self):
        graph = {"a": {"b"}, "b": {"c", "d"}, "c": {"a"}, "d": {"e"}, "e": set()}
        self.assertEqual(circles(graph), [["a", "b", "c"]])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
