"""How an occluder is written, whatever the format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from simplifier.checks import check_flag, check_one_of
from simplifier.options.simplify import Sides


@dataclass(frozen=True)
class Style:
    """``sides``  "double": for renderers that draw both sides of a triangle.  "single": for those
    that cull back faces, so that triangles which can be seen from both sides are there twice.
    ``quads``  write two triangles as a quad where they pair up, in formats that have quads.

    Raises :class:`~simplifier.errors.OptionError`.
    """

    sides: Sides = "double"
    quads: bool = False

    def __post_init__(self) -> None:
        check_one_of("sides", self.sides, get_args(Sides))
        check_flag("quads", self.quads)


PLAIN = Style()
