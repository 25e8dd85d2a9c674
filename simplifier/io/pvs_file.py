"""The file of potentially visible sets, ``.pvs``: one to map and look up in.

Little-endian; every block begins at a multiple of 16 bytes, so that a program that maps the file
uses it in place.  ``docs/formats.md`` has it byte by byte, and ``integrations/c/visibility.h``
reads it.  A wrong set hides what can be seen, so a checksum over all bytes refuses any damage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path
from simplifier.errors import OutputError, UnreadablePvsError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import METHODS, UNKNOWN, Pvs, Rows
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import BOX, PRISM, ViewCells
from simplifier.io.blocks import Blocks, check_sealed, sealed
from simplifier.io.files import read_bytes, write_whole
from simplifier.io.pvs_grid import tile_grid
from simplifier.io.pvs_header import HEADER, damage, u32
from simplifier.io.pvs_names import GROUP, decode_names, encode_names
from simplifier.io.pvs_partly import (
    decode_altitudes,
    decode_slices,
    encode_altitudes,
    encode_slices,
)
from simplifier.options.simplify import Axis

MAGIC = b"\x89PVS\r\n\x1a\n"  # as PNG's: a transfer as text damages it
PVS_VERSION = 3
_OLDEST = 2  # that is read: without slices and altitudes
NO_ROW = 0xFFFFFFFF
"""In place of a row: the cell is not computed."""

_CONSERVATIVE, _SLICES, _ALTITUDES, _PARTIAL = 1, 2, 4, 8  # of the flags
_UP = 8  # the bit at which the up axis begins
_KNOWN = {2: _CONSERVATIVE | _PARTIAL | 3 << _UP, 3: 15 | 3 << _UP}
_FARTHEST = 1e36  # of a coordinate: the look-up grid around it has to fit float32
_MOST_OBJECTS = int(np.iinfo(np.int32).max)

_GRID = np.dtype([
    ("low", "<f4", 2), ("edge", "<f4"), ("shape", "<u4", 2), ("reserved", "<u4", 3),
])  # fmt: skip
_CELL = 8  # numbers: three corners in plan, the lowest and the highest height


def save_pvs(pvs: Pvs, path: str | Path) -> None:
    """Write the file, whole or not at all.

    Raises :class:`OutputError` as :func:`encode_pvs` does, and when the file cannot be written.
    """
    write_whole(as_path("path", path), encode_pvs(pvs))


def load_pvs(path: str | Path) -> Pvs:
    """What :func:`save_pvs` wrote.

    ``pvs.visible(point)`` tells which objects can be seen from a world point, ``pvs.visible(cell)``
    which from a cell.  Raises :class:`UnreadablePvsError`.
    """
    path = as_path("path", path)
    where = str(path)
    return decode_pvs(
        read_bytes(
            path,
            error=UnreadablePvsError,
            remedy="name a file of visible sets",
            check_start=lambda start, size: _check_start(start, size, where),
        ),
        where,
    )


def encode_pvs(pvs: Pvs) -> bytes:
    """The bytes of the file; the same for the same sets.

    What UTF-8 cannot write of a name becomes "?".  Raises :class:`OutputError` for what the format
    has no room for.
    """
    _check_fits(pvs)
    header = np.zeros((), dtype=HEADER)
    header["magic"], header["version"] = MAGIC, PVS_VERSION
    flags = _CONSERVATIVE * pvs.conservative | _PARTIAL * pvs.partial | "xyz".index(pvs.up) << _UP
    flags |= _SLICES * (pvs.slices is not None) | _ALTITUDES * (pvs.altitudes is not None)
    header["flags"], header["method"] = flags, METHODS.index(pvs.method)
    header["objects"], header["cells"] = len(pvs.names), len(pvs.cells)
    header["rows"], header["origin"] = len(pvs.rows), pvs.origin
    if len(pvs.cells):
        header["low"], header["high"] = pvs.cells.low.min(axis=0), pvs.cells.high.max(axis=0)
    header["scene"], header["settings"] = np.void(pvs.scene), np.void(pvs.settings)
    return sealed(header, _encode_blocks(pvs), u32)


def _check_fits(pvs: Pvs) -> None:
    far = max(np.abs(pvs.cells.low).max(initial=0.0), np.abs(pvs.cells.high).max(initial=0.0))
    if not far < _FARTHEST or not np.isfinite(pvs.origin).all():
        raise OutputError(
            f"the view cells reach {far:g} from their origin {pvs.origin.tolist()}",
            where="visible sets",
            remedy=f"keep both finite, and the cells within {_FARTHEST:g}",
        )


def _encode_blocks(pvs: Pvs) -> dict[str, bytes]:
    grid = tile_grid(pvs.cells)
    head = np.zeros((), dtype=_GRID)
    head["low"], head["edge"], head["shape"] = grid.low, grid.edge, grid.shape
    listed = np.concatenate([grid.starts, grid.cells])
    row_of = np.where(pvs.row_of == UNKNOWN, NO_ROW, pvs.row_of)
    u32(int(grid.starts[-1]), "entries of the look-up grid")
    u32(int(pvs.rows.offsets[-1]), "bytes of rows")
    blocks = {
        "order": pvs.order.astype("<u4").tobytes(),
        "cells": _cell_numbers(pvs.cells).tobytes(),
        "grid": head.tobytes() + listed.astype("<u4").tobytes(),
        "row_of": row_of.astype("<u4").tobytes(),
        "row_offsets": pvs.rows.offsets.astype("<u4").tobytes(),
        "rows": pvs.rows.data,
    }
    if pvs.slices is not None:
        blocks["slices"] = encode_slices(pvs, pvs.slices)
    if pvs.altitudes is not None:
        blocks["altitudes"] = encode_altitudes(pvs, pvs.altitudes)
    if any(pvs.names):
        starts, names = encode_names(pvs.names)
        u32(len(names), "bytes of names")
        blocks["names"] = starts.astype("<u4").tobytes() + names
    return blocks


def _cell_numbers(cells: ViewCells) -> NDArray[np.float32]:
    """(n, 8): x0 y0 x1 y1 x2 y2 z0 z1; a box has its low and its high corner, then NaN."""
    numbers = np.full((len(cells), _CELL), np.nan, dtype="<f4")
    box = cells.kinds == BOX
    numbers[box, 0:2], numbers[box, 2:4] = cells.low[box, :2], cells.high[box, :2]
    numbers[~box, :6] = cells.corners[~box].reshape(-1, 6)
    numbers[:, 6], numbers[:, 7] = cells.low[:, 2], cells.high[:, 2]
    return numbers


def decode_pvs(data: bytes, where: str) -> Pvs:
    """The sets of a file's bytes; messages name it ``where``.

    Nothing is made room for that the bytes do not bear out.  Raises :class:`UnreadablePvsError`.
    """
    header = _checked_header(data, where)
    file = Blocks(data, header["blocks"], HEADER.itemsize, partial(damage, where=where))
    objects, rows = int(header["objects"]), int(header["rows"])
    order, cells = _decode_order(file, objects), _decode_cells(file, header)
    _check_grid(file, len(cells))
    row_of = file.array("row_of", "<u4", len(cells)).astype(np.int64)
    row_of[row_of == NO_ROW] = UNKNOWN
    if row_of.max(initial=UNKNOWN) >= rows:
        raise file.damage(f"a cell names row {row_of.max()}, but there are {rows}")
    pvs = Pvs(
        _up(header, file),
        header["origin"].astype(np.float64),
        _decode_names(file, objects),
        order,
        cells,
        _decode_rows(file, rows, objects),
        row_of,
        METHODS[header["method"]],
        bool(header["flags"] & _CONSERVATIVE),
        header["scene"].tobytes(),
        header["settings"].tobytes(),
    )
    if pvs.partial != bool(header["flags"] & _PARTIAL):
        raise file.damage("it does not say truly whether all cells are computed")
    return replace(
        pvs,
        slices=decode_slices(file, pvs) if header["flags"] & _SLICES else None,
        altitudes=decode_altitudes(file, pvs) if header["flags"] & _ALTITUDES else None,
    )


def _check_start(start: bytes, size: int, where: str) -> None:
    if size < HEADER.itemsize or not start.startswith(MAGIC):
        raise damage("this is not a file of visible sets: it does not begin as one", where)


def _checked_header(data: bytes, where: str) -> np.void:
    """The header of bytes that are those that were written, as far as a checksum can tell."""
    _check_start(data, len(data), where)
    header: np.void = np.frombuffer(data, dtype=HEADER, count=1)[0]
    if header["version"] < _OLDEST:
        raise UnreadablePvsError(
            f"version {header['version']} of the format is no longer read",
            where=where,
            remedy="remove it, and find the sets again",
        )
    if header["version"] > PVS_VERSION:
        raise _unknown(f"version {header['version']} of the format is", where)
    _check_flags(header, where)
    check_sealed(header, data, partial(damage, where=where))
    if header["method"] >= len(METHODS):
        raise damage(f"its method is number {header['method']} of {len(METHODS)}", where)
    if header["objects"] > _MOST_OBJECTS:
        raise damage(f"it claims {header['objects']} objects", where)
    if not np.isfinite(header["origin"]).all():
        raise damage("its origin is not finite", where)
    return header


def _check_flags(header: np.void, where: str) -> None:
    """Of version 2 slices and altitudes are not known; of this one each has a flag and a block."""
    flags = int(header["flags"])
    blocks = [bool(header["blocks"][name]) for name in ("slices", "altitudes")]
    if flags & ~_KNOWN[int(header["version"])] or (header["version"] == _OLDEST and any(blocks)):
        raise _unknown(f"what it holds besides cells and rows (flags {flags}) is", where)
    if blocks != [bool(flags & _SLICES), bool(flags & _ALTITUDES)]:
        raise damage("it does not say truly whether it has slices and altitudes", where)


def _up(header: np.void, file: Blocks) -> Axis:
    axes: Sequence[Axis] = ("x", "y", "z")
    axis = int(header["flags"]) >> _UP & 3
    if axis >= len(axes):
        raise file.damage("its up axis is none of x, y and z")
    return axes[axis]


def _decode_order(file: Blocks, objects: int) -> NDArray[np.int32]:
    order = file.array("order", "<u4", objects)
    if not np.array_equal(np.sort(order), np.arange(objects)):
        raise file.damage("the order of its objects does not name each once")
    return order.astype(np.int32)


def _decode_cells(file: Blocks, header: np.void) -> ViewCells:
    stored = file.array("cells", "<f4", _CELL * int(header["cells"])).reshape(-1, _CELL)
    with np.errstate(invalid="ignore"):  # some kinds of NaN would be told
        numbers = stored.astype(np.float64)
    box = np.asarray(np.isnan(numbers[:, 4:6]).all(axis=1))
    numbers[box, 4:6] = 0.0
    if not np.isfinite(numbers).all():
        raise file.damage("a view cell has a coordinate that is not finite")
    corners = numbers[:, :6].reshape(-1, 3, 2)
    low = np.where(box[:, None], corners[:, 0], corners.min(axis=1))
    high = np.where(box[:, None], corners[:, 1], corners.max(axis=1))
    low, high = np.column_stack([low, numbers[:, 6]]), np.column_stack([high, numbers[:, 7]])
    filled = (low < high).all(axis=1) & (box | _counter_clockwise(corners))
    if not filled.all():
        raise file.damage(f"view cell {np.argmin(filled)} holds nothing, or winds clockwise")
    bounds = (low.min(axis=0), high.max(axis=0)) if len(box) else (np.zeros(3), np.zeros(3))
    if not np.array_equal([header["low"], header["high"]], bounds):
        raise file.damage("the box of all its view cells is not the one around them")
    kinds = np.where(box, BOX, PRISM).astype(np.uint8)
    return ViewCells(kinds, low, high, np.where(box[:, None, None], 0.0, corners))


def _counter_clockwise(corners: FloatArray) -> BoolArray:
    """(n,) of triangles (n, 3, 2)."""
    (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return np.asarray(ux * vy > uy * vx)


def _check_grid(file: Blocks, cells: int) -> None:
    """The grid serves readers in place; here all cells are looked through."""
    (head,) = file.array("grid", _GRID, 1)
    tiles = int(head["shape"][0]) * int(head["shape"][1])
    if not np.isfinite([*head["low"], head["edge"]]).all() or not head["edge"] > 0.0 or not tiles:
        raise file.damage("its look-up grid has no tiles")
    starts = file.ascending("grid", tiles, _GRID.itemsize)
    listed = file.array("grid", "<u4", int(starts[-1]), _GRID.itemsize + 4 * (tiles + 1))
    if listed.max(initial=0) >= max(cells, 1) or (len(listed) and not cells):
        raise file.damage(f"its look-up grid names cell {listed.max()}, but there are {cells}")
    falls = np.diff(listed.astype(np.int64), prepend=UNKNOWN) <= 0
    falls[starts[starts < len(listed)]] = False
    if falls.any():
        raise file.damage("the cells in a tile of its look-up grid do not ascend")


def _decode_rows(file: Blocks, count: int, objects: int) -> Rows:
    offsets = file.ascending("row_offsets", count)
    rows = Rows(file.raw("rows", int(offsets[-1])), offsets)
    try:
        rows.check(objects)
    except ValueError as error:
        raise file.damage(f"a row is no set of its objects ({error})") from None
    return rows


def _decode_names(file: Blocks, objects: int) -> tuple[str, ...]:
    """Empty ones where the file has none."""
    if not file.offsets["names"]:
        return ("",) * objects
    offsets = file.ascending("names", -(-objects // GROUP))
    text = file.raw("names", int(offsets[-1]), 4 * len(offsets))
    try:
        return decode_names(offsets, text, objects)
    except ValueError as error:
        raise file.damage(f"the name of an object is no UTF-8, or cut ({error})") from None


def _unknown(what: str, where: str) -> UnreadablePvsError:
    return UnreadablePvsError(
        f"{what} not known",
        where=where,
        remedy=f"write version {PVS_VERSION}, or use a newer release",
    )
