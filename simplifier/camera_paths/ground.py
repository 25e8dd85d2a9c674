"""Heights of columns -> the ground that is walked on.

The ground is what is left of the lowest heights after a morphological opening, as in the filtering
of laser scans (K. Zhang et al., "A Progressive Morphological Filter for Removing Nonground
Measurements", 2003), with one window; where there is nothing, it is drawn from the bases nearby.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from simplifier.camera_paths.columns import Columns
from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray

# In eye heights.
_BUMP = 12.0  # what is no wider than twice this is no hill
_UNEVEN = 1.0  # bases and floors this high above the lowest nearby still stand on the ground
_THICK = 2.0  # the ground may be a slab
_SMOOTH = 2.0  # over how far drawn ground is evened out

_SHARE = 0.1  # of the scene that one surface must have to be its ground


def ground_heights(columns: Columns, area: float, eye: float) -> tuple[FloatArray, BoolArray]:
    """(nx, ny) float64 height of the ground, and bool: whether it is a surface of the scene.

    ``area`` of the scene, seen from above.  Where the scene has a ground, bool is true on it; else
    it is true nowhere and the heights are those of the bases.
    """
    filled = columns.filled
    opened = _opened(columns.lows, int(np.ceil(_BUMP * eye / columns.cell)))
    based = filled & (columns.lows <= opened + _UNEVEN * eye)
    low = based & (columns.highs <= columns.lows + _THICK * eye)
    surface = _wide(low & ~steep(columns.highs, columns.cell), _SHARE * area / columns.cell**2)
    if surface.any():
        based, known = surface, columns.highs
    else:
        known = columns.lows
    nearest = ndimage.distance_transform_edt(~based, return_distances=False, return_indices=True)
    drawn = ndimage.gaussian_filter(known[tuple(nearest)], _SMOOTH * eye / columns.cell)
    return np.where(surface, columns.highs, drawn), surface


def steep(heights: FloatArray, cell: float) -> BoolArray:
    """(nx, ny) steeper than 45 degrees to one of the four neighbours."""
    result = np.zeros(heights.shape, dtype=np.bool_)
    with np.errstate(invalid="ignore"):  # two empty columns side by side
        for axis in (0, 1):
            step = ~(np.abs(np.diff(heights, axis=axis)) <= cell)
            before = (slice(None),) * axis + (slice(None, -1),)
            after = (slice(None),) * axis + (slice(1, None),)
            result[before] |= step
            result[after] |= step
    return result


def _opened(lows: FloatArray, reach: int) -> FloatArray:
    """What is left of the heights when bumps up to 2 ``reach`` + 1 wide are cut off; gaps are none.

    A slope loses the last ``reach`` of its upper end at the grid's edge, which costs a strip to
    walk on; windows about places outside would keep it, and with it eaves that hang over the edge.
    """
    size = 2 * reach + 1
    eroded = ndimage.minimum_filter(lows, size, mode="nearest")
    eroded[np.isinf(eroded)] = -np.inf
    return np.asarray(ndimage.maximum_filter(eroded, size, mode="nearest"))


def _wide(surface: BoolArray, least: float) -> BoolArray:
    """The connected parts of at least so many columns."""
    labels, _ = ndimage.label(surface)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray((sizes >= max(least, 1.0))[labels])
