"""Visible sets as the dashboard shows them: a plan of cells and objects, sets to look up, a scene.

scene.glb     all objects, one after the other, in the scene's order
plan.json     cells and objects in plan, and where each cell's set is in ``sets.bin``
sets.bin      sets as runs, of which a page asks for the few hundred bytes that it needs
parts.bin     slices, and altitudes.bin, where the sets have them: what is drawn of their objects
names.json    of the objects
page.json     the axis that is up, and the cells with the largest sets
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier import Pvs, VisibleSets

_LARGEST = 10
_DIGITS = 6  # of a coordinate, relative to the scene's size: less than a pixel of any screen


def write_view(made: VisibleSets, folder: Path) -> None:
    """Write the files into a folder that is made; raises OSError and :class:`OutputError`."""
    folder.mkdir()
    triangles = made.save_for_viewing(folder / "scene.glb")
    sizes = made.set_sizes()
    _write(folder / "plan.json", _plan(made, sizes, triangles))
    (folder / "sets.bin").write_bytes(made.pvs.rows.data)
    _write(folder / "names.json", list(made.pvs.names))
    if made.pvs.slices is not None:
        (folder / "parts.bin").write_bytes(made.pvs.slices.values.tobytes())
    if made.pvs.altitudes is not None:
        (folder / "altitudes.bin").write_bytes(made.pvs.altitudes.values.astype("<u2").tobytes())
    _write(folder / "page.json", {"up": made.pvs.up, "largest": _largest(made.pvs, sizes)})


def _plan(
    made: VisibleSets, sizes: NDArray[np.int64], triangles: NDArray[np.int64]
) -> dict[str, Any]:
    """``cells``     a low and a high corner of each in plan, or three corners; relative to
                  ``origin``, as all here, with z up.
    ``heights``   of each cell, from and to; ``sizes`` of its set, -1 where it is not known.
    ``rows``      the place of each cell's set in ``offsets``, -1 where everything counts as seen.
    ``order``     the objects as runs in ``sets.bin`` have them.
    ``boxes``     a low and a high corner of each object in plan; ``triangles`` of it in the scene.
    ``slices``    along each axis, and ``starts`` of each cell's objects in ``parts.bin``, three i8
                  each; None without slices.
    ``altitudes``  the lowest one in the world and the step, for a row of u16 a cell in
                  ``altitudes.bin``; None without altitudes.
    """
    pvs, boxes = made.pvs, made.upright.boxes
    cells = pvs.cells
    boxes_of_cells = np.concatenate([cells.low[:, :2], cells.high[:, :2]], axis=1)
    outlines = [
        corners.ravel() if prism else box
        for prism, corners, box in zip(cells.kinds, cells.corners, boxes_of_cells, strict=True)
    ]
    return {
        "up": pvs.up,
        "origin": pvs.origin.tolist(),
        "cells": [_rounded(one) for one in outlines],
        "heights": [_rounded(one) for one in zip(cells.low[:, 2], cells.high[:, 2], strict=True)],
        "rows": pvs.row_of.tolist(),
        "offsets": pvs.rows.offsets.tolist(),
        "sizes": sizes.tolist(),
        "order": pvs.order.tolist(),
        "boxes": [_rounded(one) for one in boxes[:, :, :2].reshape(-1, 4)],
        "triangles": triangles.tolist(),
        "slices": _slices(pvs),
        "altitudes": _altitudes(pvs),
    }


def _slices(pvs: Pvs) -> dict[str, Any] | None:
    cut = pvs.slices
    return None if cut is None else {"count": cut.count, "starts": cut.starts.tolist()}


def _altitudes(pvs: Pvs) -> dict[str, Any] | None:
    found = pvs.altitudes
    if found is None:
        return None
    return {"low": found.low + float(pvs.origin[2]), "step": found.step}


def _largest(pvs: Pvs, sizes: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Cells by the size of their sets, largest first, with the middles of their plans."""
    first = np.argsort(-sizes, kind="stable")[:_LARGEST]
    middles = 0.5 * (pvs.cells.low + pvs.cells.high)
    return [
        {"cell": cell, "objects": int(sizes[cell]), "middle": _world(pvs, middles[cell])}
        for cell in first.tolist()
        if sizes[cell] >= 0
    ]


def _world(pvs: Pvs, point: NDArray[np.float64]) -> list[float]:
    """A point of the cells' space, where z is up."""
    up = "xyz".index(pvs.up)
    world = np.empty(3)
    world[[(up + 1) % 3, (up + 2) % 3, up]] = point + pvs.origin
    return [float(value) for value in world]


def _rounded(values: Any) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def _write(path: Path, document: Any) -> None:
    path.write_text(json.dumps(document, separators=(",", ":"), allow_nan=False), "utf-8")
