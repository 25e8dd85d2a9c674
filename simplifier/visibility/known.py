"""What is known of each cell: by an earlier Pvs, and by what is seen now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.pvs import SLICES, UNKNOWN, Altitudes, Pvs, Slices
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.method import Seen


@dataclass(frozen=True, eq=False)
class Known:
    """What is seen from one cell, of the objects (n) in the scene's order.

    ``visible``    (n,) bool.
    ``slices``     (k, 3) int8 of the visible objects, or None.
    ``altitudes``  (n,) uint16, or None.
    """

    visible: BoolArray
    slices: NDArray[np.int8] | None
    altitudes: NDArray[np.uint16] | None


def known_of(seen: Seen) -> list[Known]:
    """What is known of each of the cells that were seen from."""
    return [
        Known(
            visible,
            None if seen.slices is None else seen.slices[cell][visible],
            None if seen.altitudes is None else seen.altitudes[cell],
        )
        for cell, visible in enumerate(seen.visible)
    ]


def kept(cells: ViewCells, before: Pvs, low: float, step: float) -> list[Known | None]:
    """What earlier sets tell of each cell, altitudes counted by ``low`` and ``step``."""
    places = {cell_key(before.cells, cell): cell for cell in range(len(before.cells))}
    found = [places.get(cell_key(cells, cell), UNKNOWN) for cell in range(len(cells))]
    slices, altitudes = before.slices, before.altitudes
    if slices is not None and slices.count != SLICES:
        slices = None
    if altitudes is not None:
        altitudes = altitudes.counted(low, step)
    return [
        None
        if cell == UNKNOWN or before.row_of[cell] == UNKNOWN
        else Known(
            before.visible(cell),
            None if slices is None else slices.of(cell),
            None if altitudes is None else altitudes.values[cell],
        )
        for cell in found
    ]


def cell_key(cells: ViewCells, cell: int) -> bytes:
    """What tells a cell from others."""
    parts = (cells.low[cell], cells.high[cell], cells.corners[cell])
    return b"".join(part.tobytes() for part in parts)


def slices_of(known: Sequence[Known | None]) -> Slices | None:
    """The slices of all cells; cells without any have their objects drawn as wholes."""
    if all(each is None or each.slices is None for each in known):
        return None
    parts = [np.empty((0, 3), np.int8) if each is None else _slices(each) for each in known]
    starts = np.cumsum([0, *map(len, parts)], dtype=np.int64)
    return Slices(starts, np.concatenate(parts))


def _slices(known: Known) -> NDArray[np.int8]:
    if known.slices is None:
        return np.zeros((int(known.visible.sum()), 3), dtype=np.int8)
    return known.slices


def altitudes_of(
    known: Sequence[Known | None], objects: int, low: float, step: float
) -> Altitudes | None:
    """The altitudes of all cells; in cells without any, objects are seen from every height."""
    if all(each is None or each.altitudes is None for each in known):
        return None
    values = np.zeros((len(known), objects), dtype=np.uint16)
    for cell, each in enumerate(known):
        if each is not None and each.altitudes is not None:
            values[cell] = each.altitudes
    return Altitudes(low, step, values)
