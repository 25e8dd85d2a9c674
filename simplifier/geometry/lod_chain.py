"""LodChain: occluders of one object from fine to coarse, each with its own error bound."""

from __future__ import annotations

from dataclasses import dataclass, field

from simplifier.geometry.camera import Lens
from simplifier.geometry.occluder import Occluder


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

    def switch_distance(
        self, index: int, lens: Lens | None = None, pixels: float | None = None
    ) -> float:
        """The least distance from which the error of a level stays within the pixels.

        By the promised error bound, not by the measured deviation.
        """
        chosen = self.lens if lens is None else lens
        error = self.pixel_error if pixels is None else pixels
        return chosen.distance(self.levels[index].error_bound, error)

    def at(self, distance: float, lens: Lens | None = None, pixels: float | None = None) -> Level:
        """The coarsest level whose error stays within the pixels there, else the finest."""
        for index in range(len(self.levels) - 1, 0, -1):
            if self.switch_distance(index, lens, pixels) <= distance:
                return self.levels[index]
        return self.levels[0]
