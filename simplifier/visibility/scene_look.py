"""Scene + ViewCells -> SceneLook: what tells which method of visible sets serves.

A sample of the objects is looked at, always the same one, so the same input is always served alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.method import Task
from simplifier.visibility.solid.object_heights import Shape, base_of
from simplifier.visibility.strong.convexity import CLOSED, convexity_of

_OBJECTS = 256  # that are looked at
_FACES = 2_000  # of an object: with more it is not asked whether it is convex
_FLAT = 1e-6  # of the extent: how high over what is below things may stand
_BITS = 16  # of the curve that cells are ordered along


@dataclass(frozen=True)
class SceneLook:
    """``convex``    share of a sample of the objects that is convex, 0 to 1.
    ``width``     the median of the shorter sides of these in plan; 0 where none is.
    ``size``      the median of the cells' longer sides in plan.
    """

    convex: float
    width: float
    size: float


def standing_share(task: Task) -> float:
    """Of a task without a terrain, something of which hides: the share of the volume of what may
    hide, by the boxes of a sample, that is solid from the ground up, 0 to 1.
    """
    hiding, flat = _hiding(task), _flat(task)
    filled = stood = 0.0
    for index, stands in _sample(task):
        volume = float(np.prod(np.maximum(np.ptp(hiding.boxes[index], axis=0), flat)))
        filled += volume
        if stands:
            mesh = hiding.scene.joined([index])
            shape = np.ascontiguousarray(mesh.vertices[:, hiding.order] - hiding.origin), mesh.faces
            stood += volume if base_of(*shape, task.options.ground)[0] is not None else 0.0
    return stood / filled if filled > 0.0 else 0.0


def look_at(task: Task) -> SceneLook:
    """Look at a task without a terrain, something of which hides."""
    hiding = _hiding(task)
    known: dict[int, int | None] = {}
    widths = []
    sample = _sample(task)
    for index, stands in sample:
        which = int(hiding.scene.mesh_of[index])
        if which not in known:
            mesh = hiding.scene.meshes[which]
            known[which] = _base_if_convex((mesh.vertices, mesh.faces))
        base = known[which]
        if base == CLOSED or (base is not None and stands):
            widths.append(float(np.ptp(hiding.boxes[index], axis=0)[:2].min()))
    sizes = (task.cells.high - task.cells.low)[:, :2].max(axis=1)
    return SceneLook(
        len(widths) / len(sample),
        float(np.median(widths)) if widths else 0.0,
        float(np.median(sizes)),
    )


def _hiding(task: Task) -> UprightScene:
    return task.upright if task.opaque is None else task.upright.with_scene(task.opaque)


def _flat(task: Task) -> float:
    return _FLAT * float(task.upright.extent.max())


def _sample(task: Task) -> list[tuple[int, bool]]:
    """Objects of what hides, always the same ones, and whether each stands on the ground."""
    boxes = _hiding(task).boxes
    chosen = np.linspace(0, len(boxes) - 1, min(len(boxes), _OBJECTS)).round().astype(np.int64)
    floor, flat = float(task.upright.boxes[:, 0, 2].min()), _flat(task)
    return [
        (index, task.options.ground or _stands(boxes, index, floor, flat))
        for index in np.unique(chosen).tolist()
    ]


def _stands(boxes: FloatArray, index: int, floor: float, flat: float) -> bool:
    """Whether an object is on the ground, or on what is."""
    low = float(boxes[index, 0, 2])
    if low <= floor + flat:
        return True
    middle = boxes[index, :, :2].mean(axis=0)
    below = (boxes[:, 0, 2] <= floor + flat) & (boxes[:, 1, 2] >= low - flat)
    below &= (boxes[:, 0, :2] <= middle).all(axis=1) & (boxes[:, 1, :2] >= middle).all(axis=1)
    return bool(below.any())


def _base_if_convex(shape: Shape) -> int | None:
    if len(shape[1]) > _FACES:
        return None
    found = convexity_of(*shape)
    return None if found is None else found.base


def has_storeys(cells: ViewCells) -> bool:
    """Whether some cells are above others, as far as squares as wide as the cells tell."""
    size = max(float(np.median((cells.high - cells.low)[:, :2].max(axis=1))), 1e-300)
    middles = 0.5 * (cells.low + cells.high)[:, :2]
    squares = np.floor((middles - middles.min(axis=0)) / size).astype(np.int64)
    _, owner = np.unique(squares, axis=0, return_inverse=True)
    owner = owner.reshape(-1)
    lowest = np.full(int(owner.max()) + 1, np.inf)
    np.minimum.at(lowest, owner, cells.high[:, 2])
    return bool((cells.low[:, 2] >= lowest[owner]).any())


def spread(cells: ViewCells, places: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """So many of ``places`` (k,), one from each part of a curve through them all, ascending.

    The curve is that of G. M. Morton, "A computer oriented geodetic data base and a new technique
    in file sequencing" (1966), in plan.
    """
    if len(places) <= count:
        return places
    middles = 0.5 * (cells.low + cells.high)[places, :2]
    low = middles.min(axis=0)
    step = max(float((middles.max(axis=0) - low).max()), 1e-300) / ((1 << _BITS) - 1)
    x, y = ((middles - low) / step).astype(np.int64).T
    code = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        code |= (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)
    order = np.argsort(code, kind="stable")
    middle = (len(places) * (2 * np.arange(count) + 1)) // (2 * count)
    return np.sort(places[order[middle]])
