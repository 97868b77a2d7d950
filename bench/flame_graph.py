#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Draws the call stacks that `perf script` prints as an SVG: each box is a function, as wide as its share of all
samples, on top of its caller. Hovering over a box shows name and share."""
import argparse
import html
import re
import sys
import zlib

WIDTH, ROW, MARGIN, LEAST_SHARE = 1200, 18, 10, 0.001
CLONED = re.compile(r"^slsd::Cloned<&\(?(?:void )?(?:slsd::)?(?:\(anonymous namespace\)::)?(\w+).*>::(plain|avx512|avx2_fma|avx2)\b")


def short(name):
    """The function's name without parameters, templates and namespaces."""
    cloned = CLONED.match(name)
    if cloned:
        return f"{cloned[1]} [{cloned[2]}]"
    depth, plain = 0, ""
    for letter in name.replace("(anonymous namespace)", ""):
        depth += letter in "<("
        if depth == 0:
            plain += letter
        depth -= letter in ">)"
    return re.sub(r"^.* ", "", plain).replace("slsd::", "").strip(":") or name


def stacks(lines):
    """Yields the stacks of `perf script -F ip,sym`, the outermost caller first."""
    stack = []
    for line in lines:
        if line.strip():
            parts = line.split(None, 1)
            stack.append(short(parts[1].strip()) if len(parts) > 1 else "[unknown]")
        elif stack:
            yield stack[::-1]
            stack = []
    if stack:
        yield stack[::-1]


def tree(all_stacks):
    root = {"count": 0, "calls": {}}
    for stack in all_stacks:
        root["count"] += 1
        node = root
        for name in stack:
            node = node["calls"].setdefault(name, {"count": 0, "calls": {}})
            node["count"] += 1
    return root


def boxes(node, total, left, level):
    """Yields (name, share, left, level) of all boxes that can be seen."""
    for name, call in sorted(node["calls"].items()):
        share = call["count"] / total
        if share >= LEAST_SHARE:
            yield name, share, left, level
            yield from boxes(call, total, left, level + 1)
        left += share


def colour(name):
    value = zlib.crc32(name.encode())
    return f"hsl({20 + value % 35},{55 + value // 64 % 30}%,{62 + value // 4096 % 14}%)"


def draw(root, title):
    all_boxes = list(boxes(root, root["count"], 0, 0))
    levels = 1 + max(level for *_, level in all_boxes)
    height = (levels + 2) * ROW + 2 * MARGIN
    inner = WIDTH - 2 * MARGIN
    yield (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
           'font-family="sans-serif" font-size="11">')
    yield f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>'
    yield f'<text x="{WIDTH / 2}" y="{MARGIN + 12}" text-anchor="middle" font-size="14">{html.escape(title)}</text>'
    for name, share, left, level in all_boxes:
        x, y, width = MARGIN + inner * left, height - MARGIN - (level + 1) * ROW, inner * share
        letters = int(width / 6.2)
        text = name if len(name) <= letters else name[:max(0, letters - 1)] + "…" if letters > 3 else ""
        yield (f'<g><title>{html.escape(name)}: {100 * share:.1f} %</title><rect x="{x:.1f}" y="{y}" width="{width:.1f}" '
               f'height="{ROW - 1}" fill="{colour(name)}"/><text x="{x + 3:.1f}" y="{y + 12}">{html.escape(text)}</text></g>')
    yield "</svg>"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--title", default="processor time of slsd")
    arguments = parser.parse_args()
    root = tree(stacks(sys.stdin))
    if root["count"] == 0:
        sys.exit("flame_graph.py: the input holds no samples; make it with: perf script -F ip,sym")
    print("\n".join(draw(root, f"{arguments.title}: {root['count']} samples")))


if __name__ == "__main__":
    main()
