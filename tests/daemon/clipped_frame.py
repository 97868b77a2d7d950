# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A frame that is too bright."""


def write_clipped(file):
    """A camera's image of a pattern with saturated symbols."""
    rows = [bytes(255 if x % 16 < 8 and y % 16 < 8 else 20 for x in range(640)) for y in range(16)]
    file.write_bytes(b"P5 640 480 255\n" + b"".join(rows[y % 16] for y in range(480)))
    return file
