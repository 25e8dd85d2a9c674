"""How an occluder is written, whatever the format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from simplifier.checks import check_flag, check_one_of

Sides = Literal["double", "single"]

Embedding = Literal["godot", "lod"]
"""How an occluder is written with its original.  ``godot``: a node of the scene whose name ends in
"-occonly", of which Godot 4 makes an occluder.  ``lod``: the coarsest level of detail of the
scene's root, by MSFT_lod."""


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
