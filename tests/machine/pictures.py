# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""8-bit grey PNG files, read with the standard library alone."""
import struct
import zlib


def paeth(left, above, corner):
    estimate = left + above - corner
    return min((left, above, corner), key=lambda value: abs(estimate - value))


def read_png(data):
    """@return width, height and the rows, one after the other"""
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, *form = struct.unpack(">IIBBBBB", body)
            assert form == [8, 0, 0, 0, 0], f"not 8-bit grey: {form}"
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    filtered, rows, above = zlib.decompress(packed), bytearray(), bytearray(width)
    for begin in range(0, len(filtered), width + 1):
        kind, row = filtered[begin], bytearray(filtered[begin + 1:begin + 1 + width])
        for x in range(width if kind else 0):
            left, corner = (row[x - 1], above[x - 1]) if x else (0, 0)
            row[x] = row[x] + (0, left, above[x], (left + above[x]) // 2, paeth(left, above[x], corner))[kind] & 255
        rows += row
        above = row
    return width, height, bytes(rows)


def pad(width, rows, wanted):
    """Black to the right."""
    return b"".join(rows[at:at + width] + bytes(wanted - width) for at in range(0, len(rows), width))
