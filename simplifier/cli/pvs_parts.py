"""What ``occluder pvs-show`` tells of slices and altitudes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simplifier.geometry.pvs import NEVER, drawn
from simplifier.geometry.scene import axis_order

if TYPE_CHECKING:
    from simplifier.geometry.pvs import Altitudes, Pvs, Slices


def parts_rows(pvs: Pvs) -> list[tuple[str, str]]:
    """A row for the slices of a file, and one for its altitudes, if it has them."""
    rows = []
    if pvs.slices is not None:
        count = pvs.slices.count
        ranges = drawn(pvs.slices.values, count)
        whole = (ranges == (1, count)).all(axis=2).any(axis=1)
        parted = 100.0 * (1.0 - whole.mean()) if len(whole) else 0.0
        rows.append((
            "slices",
            f"{count} along each axis; {parted:.1f} % of what is visible is drawn in"
            " part",
        ))  # fmt: skip
    if pvs.altitudes is not None:
        low = pvs.altitudes.low + pvs.origin[2]
        rows.append(("altitudes", f"steps of {pvs.altitudes.step:.6g}, from {low:.6g} up"))
    return rows


def parts_of(pvs: Pvs, cells: list[int]) -> list[str]:
    """(n) what follows each object's name: the slices that are drawn of it, and from which height
    it is seen, in the first of some cells that is computed; nothing where it is drawn as a whole.
    """
    computed = [cell for cell in cells if pvs.row_of[cell] >= 0]
    if not computed:
        return [""] * len(pvs.names)
    slices = [""] * len(pvs.names)
    if pvs.slices is not None:
        slices = _slices_of(pvs, pvs.slices, computed[0])
    heights = [""] * len(pvs.names)
    if pvs.altitudes is not None:
        heights = _heights_of(pvs, pvs.altitudes, computed[0])
    told = ["; ".join(filter(None, each)) for each in zip(slices, heights, strict=True)]
    return [f": {each}" if each else "" for each in told]


def _slices_of(pvs: Pvs, slices: Slices, cell: int) -> list[str]:
    axes = ["xyz"[axis] for axis in axis_order(pvs.up).tolist()]
    told = []
    for ranges in pvs.drawn(cell).tolist():
        some = [
            f"{axis} {low} to {high}"
            for axis, (low, high) in zip(axes, ranges, strict=True)
            if low <= high
        ]
        whole = not some or any(each == [1, slices.count] for each in ranges)
        told.append("" if whole else f"slices {' and '.join(some)} of {slices.count}")
    return told


def _heights_of(pvs: Pvs, altitudes: Altitudes, cell: int) -> list[str]:
    values = altitudes.values[cell]
    heights = altitudes.low + altitudes.step * values.astype(np.float64) + pvs.origin[2]
    return [
        f"seen from {height:.6g} up" if 0 < value < NEVER else ""
        for value, height in zip(values.tolist(), heights.tolist(), strict=True)
    ]
