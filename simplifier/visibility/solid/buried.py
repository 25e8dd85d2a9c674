"""UprightScene + ViewCells -> which cells lie within a closed object."""

from __future__ import annotations

import numpy as np
import shapely

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.solid.closed_pieces import closed_pieces, is_within

_STEPS = np.array([1e-3, 0.333, 0.667, 1.0 - 1e-3])  # of a cell, along each axis
_FLAT = 1e-6  # of an object's size: what is no higher is its base


def within_objects(hiding: UprightScene, cells: ViewCells) -> BoolArray:
    """(c,) which cells lie within an object wholly, convex or not, as points all over them tell.

    The ground closes an object's base.  A prism counts as the box around it.
    """
    buried = np.zeros(len(cells), dtype=np.bool_)
    sizes = cells.high - cells.low
    low, high = cells.low + _STEPS[0] * sizes, cells.low + _STEPS[-1] * sizes
    plans = shapely.box(*hiding.boxes[:, 0, :2].T, *hiding.boxes[:, 1, :2].T)
    own = shapely.box(*low[:, :2].T, *high[:, :2].T)
    which, objects = shapely.STRtree(plans).query(own, predicate="within")
    upright = (hiding.boxes[objects, 0, 2] <= low[which, 2]) & (
        hiding.boxes[objects, 1, 2] >= high[which, 2]
    )
    which, objects = which[upright], objects[upright]
    for index in np.unique(objects).tolist():
        some = which[objects == index]
        buried[some] |= _are_within(hiding, index, cells.some(some))
    return buried


def _are_within(hiding: UprightScene, index: int, cells: ViewCells) -> BoolArray:
    mesh = hiding.scene.joined([index])
    points: FloatArray = mesh.vertices[:, hiding.order] - hiding.origin
    floor = float(points[:, 2].min()) + _FLAT * float(np.ptp(points, axis=0).max())
    pieces = closed_pieces(points, mesh.faces, floor)
    lattice = np.stack(np.meshgrid(_STEPS, _STEPS, _STEPS, indexing="ij"), axis=-1).reshape(-1, 3)
    places = cells.low[:, None] + lattice * (cells.high - cells.low)[:, None]
    inside = is_within(places.reshape(-1, 3), points, mesh.faces, pieces)
    return np.asarray(inside.reshape(len(cells), -1).all(axis=1))
