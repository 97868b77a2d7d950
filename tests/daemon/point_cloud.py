# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Reads clouds without our libraries."""
import struct


def vertices(ply):
    """The depth of each point of a PLY, read without our libraries."""
    header, body = ply.split(b"end_header\n", 1)
    sizes = {"float": 4, "uchar": 1, "int": 4, "ushort": 2, "uint": 4}
    lines = header.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    stride = sum(sizes[line.split()[1]] for line in lines if line.startswith("property"))
    assert len(body) == count * stride
    return [struct.unpack_from("<3f", body, i * stride) for i in range(count)]
