"""Balls of many triangles, written a row at a time: the writer needs no memory for the mesh."""

from __future__ import annotations

from math import isqrt
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

_PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEIGHT = 0.08  # of a bump, in radii

Points = NDArray[np.float32]


def write_ball(path: Path, triangles: int) -> Path:
    """A bumpy ball of about so many triangles, twice as many meridians as parallels, as binary PLY
    or STL by the suffix; the poles are collapsed, so some triangles have no area."""
    rows = isqrt(triangles // 4)
    with path.open("wb") as file:
        (_write_ply if path.suffix == ".ply" else _write_stl)(file, rows, 2 * rows)
    return path


def _parallel(row: int, rows: int, columns: int) -> Points:
    """(columns, 3) the vertices of one row."""
    down, around = np.pi * row / rows, np.arange(columns) * (2.0 * np.pi / columns)
    radius = 1.0 + _HEIGHT * np.sin(7.0 * down + 3.0 * around)
    across = radius * np.sin(down)
    points = [across * np.cos(around), across * np.sin(around), radius * np.cos(down)]
    return np.stack(points, axis=1).astype("<f4")


def _corners(columns: int) -> NDArray[np.int32]:
    """(2 columns, 3) triangles between one row, from 0 on, and the next, behind it."""
    left = np.arange(columns, dtype=np.int32)
    right = (left + 1) % columns
    below_left, below_right = left + columns, right + columns
    halves = [(left, right, below_right), (left, below_right, below_left)]
    return np.concatenate([np.stack(half, axis=1) for half in halves])


def _write_ply(file: IO[bytes], rows: int, columns: int) -> None:
    file.write(
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {(rows + 1) * columns}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {2 * rows * columns}\nproperty list uchar int vertex_indices\n"
        "end_header\n".encode("ascii")
    )
    for row in range(rows + 1):
        file.write(_parallel(row, rows, columns).tobytes())
    faces = np.zeros(2 * columns, dtype=_PLY_FACE)
    faces["count"] = 3
    for row in range(rows):
        faces["corners"] = _corners(columns) + row * columns
        file.write(faces.tobytes())


def _write_stl(file: IO[bytes], rows: int, columns: int) -> None:
    file.write(bytes(80) + (2 * rows * columns).to_bytes(4, "little"))
    corners = _corners(columns)
    facets = np.zeros(2 * columns, dtype=_STL_FACET)
    upper = _parallel(0, rows, columns)
    for row in range(rows):
        lower = _parallel(row + 1, rows, columns)
        facets["corners"] = np.concatenate([upper, lower])[corners]
        file.write(facets.tobytes())
        upper = lower
