"""Overrides: what a person decided about an asset, to be done whatever the search would say.

Region: a box in space, turned as one likes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import translate
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OverridesError
from simplifier.geometry.mesh import FloatArray

_TOUCH = 1e-9  # of a region's longest edge, by which a flush part may be inside for rounding

NOTHING: FloatArray = np.empty((0, 3, 3))
"""No triangle at all."""


@dataclass(frozen=True)
class Pattern:
    """Names as a shell matches them, ``*`` and ``?`` and ``[a-z]``, capitals told apart.

    ``where``  the place that it was written at, for messages.
    """

    text: str
    where: str = ""

    def matches(self, names: Iterable[str]) -> bool:
        """Any of them."""
        match = _compiled(self.text).match
        return any(match(name) is not None for name in names)


@lru_cache(maxsize=4096)
def _compiled(text: str) -> re.Pattern[str]:
    """More are kept than fnmatch keeps, and than a file of overrides may have."""
    return re.compile(translate(text))


@dataclass(frozen=True)
class Ignore:
    """What of a file is not there, to make an occluder of and to judge one by.

    ``meshes``     names of objects: glTF nodes and meshes, ``o`` and ``g`` of OBJ.
    ``materials``  names of materials.
    ``see_through``  whether what can be seen through is left out, too.
    """

    meshes: tuple[Pattern, ...] = ()
    materials: tuple[Pattern, ...] = ()
    see_through: bool = True


ALL_OPAQUE = Ignore()
"""Nothing is ignored by name."""


def _name_with_place(name: str, where: str) -> str:
    return f"{name} ({where})" if where else name


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """Triangles drawn by hand, (m, 3, 3) world units: a box or a quad with its ``name``.

    ``where``  the place that it was written at, for messages.
    """

    name: str
    triangles: FloatArray
    where: str = ""

    def __str__(self) -> str:
        return _name_with_place(self.name, self.where)


@dataclass(frozen=True, eq=False)
class OpenRegion:
    """Where no triangle of an occluder may be, with its ``name``; ``where`` as above."""

    name: str
    region: Region
    where: str = ""

    def __str__(self) -> str:
        return _name_with_place(self.name, self.where)


@dataclass(frozen=True, eq=False)
class Overrides:
    """World units and axes of the mesh.

    ``drawn``   in every occluder, as they are.
    ``open``    left open by every occluder.
    ``ignore``  what of the file is not there.
    ``viewers`` (n, 3) places that someone looks from: what they see is not filled.

    Raises :class:`~simplifier.errors.OverridesError` where a drawn part reaches into an open
    region; it may be flush with it.
    """

    drawn: tuple[DrawnPart, ...] = ()
    open: tuple[OpenRegion, ...] = ()
    ignore: Ignore = ALL_OPAQUE
    viewers: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def __post_init__(self) -> None:
        triangles = self.triangles
        owners = np.repeat(np.arange(len(self.drawn)), [len(one.triangles) for one in self.drawn])
        for one in self.open:
            touch = _TOUCH * float(one.region.half.max())
            crossed = one.region.crossed_by(triangles, touch)
            if crossed.any():
                part = self.drawn[owners[crossed.argmax()]]
                raise OverridesError(
                    f"'{part.name}' reaches into the open region {one}",
                    where=part.where,
                    remedy="make one of them smaller",
                )

    @property
    def triangles(self) -> FloatArray:
        """(m, 3, 3) of all drawn parts, in order."""
        return np.concatenate([NOTHING, *(part.triangles for part in self.drawn)])


NO_OVERRIDES = Overrides()

OVERRIDES = "what simplifier.load_overrides returns"
"""What to give where overrides are asked for, for messages."""


_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FACES = np.array([  # of the corners above, outwards by the right-hand rule
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Region:
    """``centre`` (3,), ``half`` (3,) of its edges, and ``axes`` (3, 3), rows: the edges' unit
    vectors, right-handed; world units.  A region is the open set: its surface is not part of it.
    """

    centre: FloatArray
    half: FloatArray
    axes: FloatArray

    @classmethod
    def of(cls, centre: FloatArray, size: FloatArray, rotation: FloatArray) -> Region:
        """``size`` (3,) of the edges, ``rotation`` (4,) a quaternion x y z w that is not zero."""
        x, y, z, w = rotation / np.linalg.norm(rotation)
        axes = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
            [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
            [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        return cls(centre, size / 2.0, axes)

    @property
    def triangles(self) -> FloatArray:
        """(12, 3, 3) its surface, wound outwards."""
        corners = (_CORNERS * self.half) @ self.axes + self.centre
        return np.asarray(corners[_FACES])

    def meets_boxes(self, centres: FloatArray, half: float) -> NDArray[np.bool_]:
        """(n,) which of the cubes (n, 3), ``half`` an edge's half, share a point with its closure.

        By the separating axes of two boxes: three of either, and their nine products.
        """
        axes = np.concatenate([np.eye(3), self.axes, _products(self.axes, np.eye(3))])
        reach = np.abs(axes @ self.axes.T) @ self.half + half * np.abs(axes).sum(axis=1)
        return np.asarray((np.abs((centres - self.centre) @ axes.T) <= reach).all(axis=1))

    def meets_box(self, box: FloatArray) -> bool:
        """Whether its own upright box meets another (2, 3), low and high; they may be apart yet."""
        reach = np.abs(self.axes).T @ self.half
        return bool((box[0] < self.centre + reach).all() and (box[1] > self.centre - reach).all())

    def crossed_by(self, triangles: FloatArray, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """(m,) which of the triangles (m, 3, 3) have a point inside, deeper than ``tolerance``.

        By the separating axes of a box and a triangle: three, the normal, and nine products.
        """
        half = np.maximum(self.half - tolerance, 0.0)
        inside = (triangles - self.centre) @ self.axes.T
        # The box's own axes first: they separate most.
        crossed = ((inside.min(axis=1) < half) & (inside.max(axis=1) > -half)).all(axis=1)
        crossed[crossed] = _not_apart(inside[crossed], half)
        return np.asarray(crossed)


def _not_apart(inside: FloatArray, half: FloatArray) -> NDArray[np.bool_]:
    """(m,) which of the triangles (m, 3, 3), in the box's own space, neither their normals nor the
    products of edges separate from it."""
    edges = np.roll(inside, -1, axis=1) - inside
    # (m, k, 3); where one vanishes, another separates as well.
    axes = np.concatenate(
        [
            np.cross(edges[:, :1], edges[:, 1:2]),
            *(np.cross(np.eye(3)[axis], edges) for axis in range(3)),
        ],
        axis=1,
    )
    seen = np.einsum("mki,mci->mkc", axes, inside)
    reach = np.abs(axes) @ half
    apart = (seen.min(axis=2) >= reach) | (seen.max(axis=2) <= -reach)
    return np.asarray(~(apart & (axes != 0.0).any(axis=2)).any(axis=1))


def _products(one: FloatArray, other: FloatArray) -> FloatArray:
    """(9, 3) of each axis of the one with each of the other."""
    return np.cross(one[:, None], other[None]).reshape(-1, 3)
