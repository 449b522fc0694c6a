"""A small mesh, and files of it that may lie."""

import struct

import numpy as np

CORNERS = np.array([[0.0, 0.0, 0.0], [0.125, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def binary_stl(corners, claimed=None, header=b""):
    record = np.zeros(len(corners), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    record["c"] = corners
    count = len(corners) if claimed is None else claimed
    return header.ljust(80, b"\0") + struct.pack("<I", count) + record.tobytes()
