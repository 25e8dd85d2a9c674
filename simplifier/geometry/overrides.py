"""Overrides: what a person decided about an asset, to be done whatever the search would say."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from simplifier.errors import OverridesError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.region import Region

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
        return any(fnmatchcase(name, self.text) for name in names)


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


def _called(name: str, where: str) -> str:
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
        return _called(self.name, self.where)


@dataclass(frozen=True, eq=False)
class OpenRegion:
    """Where no triangle of an occluder may be, with its ``name``; ``where`` as above."""

    name: str
    region: Region
    where: str = ""

    def __str__(self) -> str:
        return _called(self.name, self.where)


@dataclass(frozen=True, eq=False)
class Overrides:
    """World units and axes of the mesh.

    ``drawn``   in every occluder, as they are.
    ``open``    left open by every occluder.
    ``ignore``  what of the file is not there.

    Raises :class:`~simplifier.errors.OverridesError` where a drawn part reaches into an open
    region; it may be flush with it.
    """

    drawn: tuple[DrawnPart, ...] = ()
    open: tuple[OpenRegion, ...] = ()
    ignore: Ignore = ALL_OPAQUE

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
