"""A scene from above: which kind of object is on top where, and how high."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene, columns_of
from simplifier.geometry.mesh import FloatArray

RgbArray = NDArray[np.uint8]

_SUN = np.array([-1.0, 1.0, 1.2]) / np.linalg.norm([-1.0, 1.0, 1.2])  # from the upper left
_STEP = 0.01  # of the range of heights: a step is drawn as an outline
_FINE = 2  # columns for a pixel of the picture along each side


@dataclass(frozen=True, eq=False)
class Plan:
    """Square columns over a window of the upright plan.

    ``low``, ``high``  (2,) its corners; ``cell`` the edge of a column.
    ``kinds``   (nx, ny) uint8: the kind of the highest object, 0 where there is none.
    ``heights`` (nx, ny) float64: of it, minus infinite where there is none.
    """

    low: FloatArray
    high: FloatArray
    cell: float
    kinds: NDArray[np.uint8]
    heights: FloatArray

    @classmethod
    def of(
        cls,
        upright: UprightScene,
        kinds: NDArray[np.uint8],
        low: FloatArray,
        high: FloatArray,
        pixels: int,
    ) -> Plan:
        """Of objects of ``kinds`` (n,), from 1 on; so many pixels along the longer side."""
        cell = float((high - low).max()) / (_FINE * pixels)
        shape = np.maximum(np.ceil((high - low) / cell - 1e-9).astype(np.int64), 1)
        heights = np.full(tuple(shape), -np.inf)
        shown = np.zeros(tuple(shape), dtype=np.uint8)
        for kind in np.unique(kinds).tolist():
            own = columns_of(upright.some(kinds == kind), low, high, cell).highs
            higher = own > heights
            heights[higher], shown[higher] = own[higher], kind
        return cls(low, high, cell, shown, heights)

    @property
    def steps(self) -> NDArray[np.bool_]:
        """(nx, ny) where the height changes at once: outlines of objects."""
        finite = self.heights[np.isfinite(self.heights)]
        if len(finite) == 0:
            return np.zeros(self.heights.shape, dtype=np.bool_)
        floor = min(float(finite.min()), 0.0) - 1.0
        known = np.where(np.isfinite(self.heights), self.heights, floor)
        least = _STEP * max(float(np.ptp(finite)), 1e-300)
        result = np.zeros(known.shape, dtype=np.bool_)
        for axis in (0, 1):
            there = np.abs(np.diff(known, axis=axis)) > least
            result[tuple(slice(1, None) if one == axis else slice(None) for one in (0, 1))] |= there
        return result

    def picture(self, colours: RgbArray) -> RgbArray:
        """(rows, columns, 3) of colours (nx, ny, 3), y upwards."""
        rows, columns = (max(count // _FINE, 1) for count in (colours.shape[1], colours.shape[0]))
        image = np.ascontiguousarray(colours.transpose(1, 0, 2)[::-1])
        return np.asarray(cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA))


def hillshade(heights: FloatArray, cell: float) -> FloatArray:
    """(nx, ny) 0 to 1, how bright a surface is with the sun at the upper left; 0.66 where level."""
    east, north = np.gradient(heights, cell)
    length = np.sqrt(east * east + north * north + 1.0)
    return np.asarray(np.clip((-east * _SUN[0] - north * _SUN[1] + _SUN[2]) / length, 0.0, 1.0))
