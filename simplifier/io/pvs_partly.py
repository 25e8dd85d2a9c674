"""Slices and altitudes in a file of visible sets: what of each object is seen, and from where."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OutputError
from simplifier.geometry.pvs import UNKNOWN, Altitudes, Pvs, Slices
from simplifier.io.blocks import Blocks
from simplifier.io.pvs_header import u32

_MOST_SLICES = 127
_HEAD = 16  # bytes, of both blocks
_SLICES = np.dtype([("count", "<u4"), ("reserved", "<u4", 3)])
_ALTITUDES = np.dtype([("low", "<f4"), ("step", "<f4"), ("reserved", "<u4", 2)])


def encode_slices(pvs: Pvs, slices: Slices) -> bytes:
    """The block: how many slices an axis has, where each cell begins, and three bytes a pair.

    The objects of a cell stand as its row names them.  Raises :class:`OutputError`.
    """
    starts = slices.starts
    u32(int(starts[-1]), "visible objects of all cells")
    if not _in_range(slices.values, slices.count):
        raise _unfit(f"slices that are none of {slices.count}")
    if len(starts) != len(pvs.cells) + 1 or starts[-1] != len(slices.values):
        raise _unfit(f"slices of {len(starts) - 1} cells and {len(slices.values)} objects")
    head = np.zeros((), dtype=_SLICES)
    head["count"] = slices.count
    values = np.empty_like(slices.values)
    for cell, (begin, end) in enumerate(pairwise(starts.tolist())):
        ranks = _ranks(pvs, cell)
        if len(ranks) != end - begin:
            raise _unfit(f"slices of {end - begin} objects in cell {cell}, which sees {len(ranks)}")
        values[begin:end] = slices.values[begin:end][ranks]
    return head.tobytes() + starts.astype("<u4").tobytes() + values.tobytes()


def decode_slices(file: Blocks, pvs: Pvs) -> Slices:
    """The slices of a file; ``pvs`` is what else it holds.  Raises :class:`UnreadablePvsError`."""
    count = int(file.array("slices", _SLICES, 1)[0]["count"])
    cells = len(pvs.cells)
    starts = file.ascending("slices", cells, _HEAD)
    stored = file.array("slices", "i1", 3 * int(starts[-1]), _HEAD + 4 * (cells + 1))
    stored = stored.reshape(-1, 3)
    if not _in_range(stored, count):
        raise file.damage(f"a slice is none of {count}")
    values = np.empty_like(stored)
    for cell, (begin, end) in enumerate(pairwise(starts.tolist())):
        ranks = _ranks(pvs, cell)
        if len(ranks) != end - begin:
            raise file.damage(
                f"it has slices of {end - begin} objects in cell {cell}, which sees {len(ranks)}"
            )
        values[begin:end][ranks] = stored[begin:end]
    return Slices(starts, values, count)


def _ranks(pvs: Pvs, cell: int) -> NDArray[np.int64]:
    """(k,) of the visible objects of a cell, as its row names them: their places by number."""
    if pvs.row_of[cell] == UNKNOWN:
        return np.empty(0, dtype=np.int64)
    named = pvs.order[pvs.rows.places(int(pvs.row_of[cell]))]
    ranks = np.empty(len(named), dtype=np.int64)
    ranks[np.argsort(named)] = np.arange(len(named))
    return ranks


def _in_range(values: NDArray[np.int8], count: int) -> bool:
    """Whether these are slices as :class:`Slices` has them; each axis of an object draws one."""
    if not 1 <= count <= _MOST_SLICES:
        return False
    low = np.array([1 - count, 1 - count, 0])
    return bool((values >= low).all() and (values <= count).all())


def encode_altitudes(pvs: Pvs, altitudes: Altitudes) -> bytes:
    """The block: the lowest altitude, their step, and a number for each cell and object.

    Raises :class:`OutputError`.
    """
    head = np.zeros((), dtype=_ALTITUDES)
    head["low"], head["step"] = altitudes.low, altitudes.step
    if (float(head["low"]), float(head["step"])) != (altitudes.low, altitudes.step):
        raise _unfit(f"altitudes of {altitudes.low} by {altitudes.step}, which are not float32")
    if not _counts(head) or altitudes.values.shape != (len(pvs.cells), len(pvs.names)):
        raise _unfit(
            f"altitudes of {altitudes.low} by {altitudes.step}, of shape {altitudes.values.shape}"
        )
    return head.tobytes() + altitudes.values.astype("<u2").tobytes()


def decode_altitudes(file: Blocks, pvs: Pvs) -> Altitudes:
    """The altitudes of a file; ``pvs`` is what else it holds.

    Raises :class:`UnreadablePvsError`.
    """
    head = file.array("altitudes", _ALTITUDES, 1)[0]
    if not _counts(head):
        raise file.damage(f"its altitudes begin at {head['low']} and have steps of {head['step']}")
    shape = len(pvs.cells), len(pvs.names)
    stored = file.array("altitudes", "<u2", shape[0] * shape[1], _HEAD)
    return Altitudes(
        float(head["low"]), float(head["step"]), stored.reshape(shape).astype(np.uint16)
    )


def _counts(head: np.ndarray | np.void) -> bool:
    return bool(np.isfinite(head["low"]) and np.isfinite(head["step"]) and head["step"] > 0.0)


def _unfit(what: str) -> OutputError:
    return OutputError(
        f"there are {what}", where="visible sets", remedy="leave them out, or find the sets again"
    )
