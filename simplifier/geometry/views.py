"""Directions on the sphere, the image axes that belong to them, and what is measured along them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.wording import count

FRONT_DEPTH = 0.01
"""Of the bounding sphere's diameter: what stands less far before a surface is as good as on it."""

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class BoundingSphere:
    """Centre of the bounding box and the largest distance of a vertex from it, world units."""

    centre: FloatArray
    radius: float

    @classmethod
    def of(cls, mesh: TriangleMesh) -> BoundingSphere:
        low, high = mesh.bounds
        return cls(np.asarray(low + (high - low) / 2.0), mesh.radius)

    def to_unit(self, points: FloatArray) -> FloatArray:
        """(n, 3) the same points where the sphere is the unit sphere, each axis contiguous.

        Centred before they are scaled, so that coordinates of a map keep all their digits.
        """
        unit = np.empty(points.shape[::-1])
        for axis, column in enumerate(points.T):
            unit[axis] = (column - self.centre[axis]) / self.radius
        return unit.T


def hemisphere_directions(count: int) -> FloatArray:
    """(count, 3) unit vectors spread evenly over the upper (+z) hemisphere (Fibonacci lattice).

    Directions d and -d give mirror images, so a hemisphere is enough for the occlusion measure.
    """
    index = np.arange(count) + 0.5
    z = 1.0 - index / count
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    angle = _GOLDEN_ANGLE * index
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def from_above(directions: FloatArray, up: int) -> FloatArray:
    """(n, 3) the same lines of sight, all level or downwards: those that rise are turned about.

    ``up`` 0 to 2: the axis that points up.  Orthographic silhouettes along d and -d are mirror
    images, so this changes who looks and not what there is to see.
    """
    rising = directions[:, up] > 0.0
    return np.where(rising[:, None], -directions, directions)


def random_directions(count: int, seed: int) -> FloatArray:
    """(count, 3) unit vectors, uniform on the sphere; the same seed gives the same vectors."""
    generator = np.random.default_rng(seed)
    z = generator.uniform(-1.0, 1.0, count)
    angle = generator.uniform(0.0, 2.0 * np.pi, count)
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def image_axes(directions: FloatArray) -> FloatArray:
    """(n, 3, 3) rows u, v, d for (n, 3) unit directions d: orthonormal, right-handed (u x v = d).

    v is the projected +y axis where d is not nearly parallel to it, else the projected +z axis,
    so that pictures of y-up assets stand upright.  A viewer who looks along +d with v up sees u
    to the left.
    """
    d = np.asarray(directions, dtype=np.float64)
    steep = np.abs(d[:, 1]) > 0.999
    up = np.where(steep[:, None], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    u = np.cross(up, d)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(d, u)
    return np.stack([u, v, d], axis=1)


@cache
def hemisphere_axes(count: int) -> FloatArray:
    """(count, 3, 3) the :func:`image_axes` of as many :func:`hemisphere_directions`, read-only."""
    axes = image_axes(hemisphere_directions(count))
    axes.setflags(write=False)
    return axes


@dataclass(frozen=True, eq=False)
class ViewShares:
    """What occluders do to pixels, view by view.

    ``by_view``    (V,) float64: the pixels in question as a share of the original's.
    ``directions`` (V, 3) float64 unit vectors, the lines of sight.
    """

    by_view: FloatArray
    directions: FloatArray

    def __repr__(self) -> str:
        views = count(len(self.by_view), "view")
        return f"<{type(self).__name__}: mean {self.mean:.4g}, worst {self.worst:.4g} of {views}>"

    @property
    def mean(self) -> float:
        """Of the shares of all views, each of which counts alike."""
        return float(self.by_view.mean())

    @property
    def worst_view(self) -> int:
        """The view with the largest share, the first of equals."""
        return int(np.argmax(self.by_view))

    @property
    def worst(self) -> float:
        """The share in that view."""
        return float(self.by_view[self.worst_view])
