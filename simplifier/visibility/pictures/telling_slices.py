"""Sets with slices -> the cell and the object whose slices tell most to a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import Pvs
from simplifier.visibility.checking.hidden_parts import hidden_boxes

_CELLS = 2000  # that are looked at, of more some from all over the scene


@dataclass(frozen=True, eq=False)
class PartlyDrawn:
    """An object of which a cell draws some slices.

    ``box``     (2, 3) float64 of the object, upright.
    ``hidden``  (2, 3) float64: the block that is not drawn; where it meets a side of the box it
                reaches out of it, so that the side is hidden, too.
    """

    cell: int
    object: int
    box: FloatArray
    hidden: FloatArray


def telling_slices(upright: UprightScene, pvs: Pvs) -> PartlyDrawn | None:
    """A large object near a cell, of whose sides towards it about half is hidden; None if cells
    draw all of these.

    ``pvs`` has slices.
    """
    assert pvs.slices is not None
    best, most = None, 0.0
    places = np.linspace(0, len(pvs.computed) - 1, min(len(pvs.computed), _CELLS))
    for cell in pvs.computed[np.rint(places).astype(np.int64)].tolist():
        objects = np.flatnonzero(pvs.visible(cell))
        boxes = upright.boxes[objects]
        hidden = hidden_boxes(boxes, pvs.slices.of(cell), pvs.slices.count)
        worth = _worth(boxes, hidden, 0.5 * (pvs.cells.low[cell] + pvs.cells.high[cell]))
        if len(worth) and worth.max() > most:
            place, most = int(worth.argmax()), float(worth.max())
            box = boxes[place]
            best = PartlyDrawn(cell, int(objects[place]), box, _over_sides(hidden[place], box))
    return best


def _worth(boxes: FloatArray, hidden: FloatArray, eye: FloatArray) -> FloatArray:
    """(k,) of boxes (k, 2, 3): how long they are, as seen from ``eye``, times both shares of their
    sides towards it, of what is hidden and of what is not."""
    sizes, blocks = boxes[:, 1] - boxes[:, 0], np.nan_to_num(hidden[:, 1] - hidden[:, 0])
    covered, whole = np.zeros(len(boxes)), np.full(len(boxes), 1e-300)
    for axis in (0, 1):
        others = [1 - axis, 2]
        for side, faces in enumerate(
            (eye[axis] < boxes[:, 0, axis], eye[axis] > boxes[:, 1, axis])
        ):
            whole += faces * sizes[:, others].prod(axis=1)
            meets = faces & (hidden[:, side, axis] == boxes[:, side, axis])
            covered += meets * blocks[:, others].prod(axis=1)
    shares = covered / whole
    lengths = np.linalg.norm(sizes, axis=1)
    away = np.linalg.norm(np.maximum(np.maximum(boxes[:, 0] - eye, eye - boxes[:, 1]), 0), axis=1)
    return np.asarray(lengths * lengths / (lengths + away) * shares * (1.0 - shares))


def _over_sides(hidden: FloatArray, box: FloatArray) -> FloatArray:
    size = box[1] - box[0]
    return np.array([
        np.where(hidden[0] == box[0], box[0] - size, hidden[0]),
        np.where(hidden[1] == box[1], box[1] + size, hidden[1]),
    ])  # fmt: skip
