"""Occluder: the result, a handful of triangles.

LodChain: occluders of one object from fine to coarse, each with its own error bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simplifier.checks import check_kind, check_positive, check_whole, check_within
from simplifier.geometry.arrays import check_arrays
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import FloatArray, IntArray, have_area
from simplifier.wording import count

AN_OCCLUDER = "what simplifier.simplify or simplifier.load_occluder returns"
"""What to hand over where an occluder is asked for."""


@dataclass(frozen=True, eq=False)
class Occluder:
    """Triangles that hide nearly what the original hides.

    ``vertices``     (n, 3) float64, world units.
    ``faces``        (m, 3) int32, m may be 0 when nothing can be hidden.
    ``error_bound``  no point of the occluder, but of parts drawn by hand, is further than this
                     from the original's surface or its filled interior, world units; infinite when
                     nothing was promised (a file made elsewhere).
    ``timings``      seconds by stage.
    ``single_sided`` whether renderers that cull back faces may: a triangle that can be seen from
                     both sides is then there in both windings.  If not, as they are made, they are
                     to be drawn double-sided.

    Raises :class:`~simplifier.errors.MeshError` for arrays of another kind or shape; what they hold
    is checked where it is used.  Both become read-only.
    """

    vertices: FloatArray
    faces: IntArray
    error_bound: float = float("inf")
    timings: Mapping[str, float] = field(default_factory=dict)
    single_sided: bool = False

    @classmethod
    def of(
        cls, triangles: FloatArray, error_bound: float, timings: Mapping[str, float]
    ) -> Occluder:
        """Of a soup (m, 3, 3), world units: equal corners become one vertex.

        Triangles without area are left out, and of those with the same corners all but the first.
        """
        vertices, place = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        faces = place.reshape(-1, 3)[have_area(triangles)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        used, corners = np.unique(faces[np.sort(first)], return_inverse=True)
        return cls(
            vertices[used], np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32),
            error_bound, dict(timings),
        )  # fmt: skip

    def __post_init__(self) -> None:
        check_arrays(self.vertices, self.faces, "pass arrays as simplifier.Occluder states them")

    def __setstate__(self, state: Mapping[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # copies and pickles are not read-only

    def __repr__(self) -> str:
        bound = f", error bound {self.error_bound:.4g}" if self.error_bound < math.inf else ""
        return f"<Occluder: {count(len(self.faces), 'triangle')}{bound}>"


@dataclass(frozen=True, eq=False)
class Level:
    """One level of detail.

    ``occluder``    with the error bound that the level promises.
    ``resolution``  voxels along the longest edge that it was made from.
    ``deviation``   the largest distance that was measured, world units, at most the error bound.
    """

    occluder: Occluder
    resolution: int
    deviation: float

    @property
    def error_bound(self) -> float:
        """What the occluder promises, world units."""
        return self.occluder.error_bound

    @property
    def triangles(self) -> int:
        """How many triangles it has."""
        return len(self.occluder.faces)


@dataclass(frozen=True)
class LeftOut:
    """A level that was asked for and is not in the chain; ``reason`` is a sentence that says why.

    ``resolution``  voxels along the longest edge that it has or would have.
    """

    resolution: int
    reason: str


@dataclass(frozen=True, eq=False)
class LodChain:
    """Levels of detail of one object.

    ``levels``       at least one, finest first: error bounds rise, triangles do not.
    ``lens``         through which the levels are meant to be seen.
    ``pixel_error``  the error on the screen that a level may show, pixels.
    ``left_out``     the levels that brought nothing, finest first.

    Distances are from the eye to the nearest point of the object, along the line of view.
    """

    levels: tuple[Level, ...]
    lens: Lens = field(default_factory=Lens)
    pixel_error: float = 1.0
    left_out: tuple[LeftOut, ...] = ()

    def __repr__(self) -> str:
        triangles = ", ".join(f"{level.triangles:,}" for level in self.levels)
        return f"<LodChain: {count(len(self.levels), 'level')} with {triangles} triangles>"

    def switch_distance(
        self, index: int, lens: Lens | None = None, pixels: float | None = None
    ) -> float:
        """The least distance from which the error of a level stays within the pixels.

        By the promised error bound, not by the measured deviation.  Raises
        :class:`~simplifier.errors.OptionError` for no such level, no lens, and pixels that are not
        above 0.
        """
        check_whole("index", index, 0, len(self.levels) - 1)
        chosen = self.lens if lens is None else lens
        error = self.pixel_error if pixels is None else pixels
        check_kind("lens", chosen, Lens, "a simplifier.Lens")
        check_positive("pixels", error)
        return chosen.distance(self.levels[index].error_bound, error)

    def at(self, distance: float, lens: Lens | None = None, pixels: float | None = None) -> Level:
        """The coarsest level whose error stays within the pixels there, else the finest.

        Raises :class:`~simplifier.errors.OptionError` for no distance, and as
        :meth:`switch_distance`.
        """
        check_within("distance", distance, 0.0, math.inf)
        for index in range(len(self.levels) - 1, 0, -1):
            if self.switch_distance(index, lens, pixels) <= distance:
                return self.levels[index]
        return self.levels[0]
