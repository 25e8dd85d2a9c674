"""Shapes of a plan seen from above: upright rectangles, what stands turned, an avenue.

Coordinates are (x, z) in metres.  A turn is an angle about +y in radians: what faced +z faces +x
after a quarter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from examples.city_models import Model
from simplifier.geometry.mesh import FloatArray


@dataclass(frozen=True)
class Rect:
    """Upright to the axes."""

    x0: float
    z0: float
    x1: float
    z1: float

    @property
    def width(self) -> float:
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        return self.z1 - self.z0

    @property
    def centre(self) -> tuple[float, float]:
        return (self.x0 + self.x1) / 2.0, (self.z0 + self.z1) / 2.0

    def corners(self) -> FloatArray:
        """(4, 2), around."""
        return np.array(
            [[self.x0, self.z0], [self.x1, self.z0], [self.x1, self.z1], [self.x0, self.z1]]
        )

    def inset(self, by: float) -> Rect:
        return Rect(self.x0 + by, self.z0 + by, self.x1 - by, self.z1 - by)


@dataclass(frozen=True)
class Spot:
    """A model, by its place in a list, where it stands."""

    model: int
    x: float
    z: float
    turn: float

    def corners(self, models: Sequence[Model]) -> FloatArray:
        """(4, 2) of the ground that it takes."""
        half = np.array([models[self.model].width, models[self.model].depth]) / 2.0
        own = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
        return own @ turned(self.turn) + [self.x, self.z]


@dataclass(frozen=True)
class Avenue:
    """A straight avenue through the middle: points at most ``half`` from a line along ``turn``."""

    turn: float = 0.52
    half: float = 15.0

    def across(self, points: FloatArray) -> FloatArray:
        """How far points (n, 2) are to one side of its middle."""
        return np.asarray(points @ turned(self.turn)[1])

    def crosses(self, points: FloatArray) -> bool:
        """Whether the convex shape with these corners reaches into it."""
        sides = self.across(points)
        return bool(sides.min() < self.half and sides.max() > -self.half)


def turned(turn: float) -> FloatArray:
    """(2, 2) rows: where +x and +z of (x, z) go; exact for quarter turns."""
    c, s = math.cos(turn), math.sin(turn)
    if abs(c) < 1e-9 or abs(s) < 1e-9:
        c, s = round(c), round(s)
    return np.array([[c, -s], [s, c]], dtype=np.float64)


def overlap(first: FloatArray, second: FloatArray) -> bool:
    """Whether two rectangles, (4, 2) corners in order, have more than a border in common."""
    for shape in (first, second):
        for axis in (shape[1] - shape[0], shape[2] - shape[1]):
            a, b = first @ axis, second @ axis
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True


def within(points: FloatArray, rect: Rect) -> bool:
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(
        low[0] >= rect.x0 and low[1] >= rect.z0 and high[0] <= rect.x1 and high[1] <= rect.z1
    )
