"""Overrides of a mesh: refused, or kept by its occluder."""

from __future__ import annotations

from pathlib import Path

from simplifier import SimplifyOptions, load, simplify
from simplifier.geometry.mesh import FloatArray, have_area
from simplifier.io.overrides import load_overrides
from simplifier.io.suffixes import overrides_place
from tests.fuzz.promises import check_sentence, promise

NAMED = b"""o wall
usemtl brick
v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
o flag
usemtl cloth
v 1 1 0.5\nv 1 2 0.5\nv 1 2 0.9\nf 9 10 11
"""
"""A box and a triangle, with names of objects and materials to ignore."""

_OPTIONS = SimplifyOptions.of(
    {"budget": 40, "preset": "draft", "resolution": 8, "moves": 20, "views": 4, "image": 16,
     "quads": 50}
)  # fmt: skip
_TOUCH = 1e-6  # of a region's longest edge: what rounding may take


def check_overrides(data: bytes, folder: Path) -> None:
    """``data`` beside a small OBJ; raises ``OccluderError`` where it is refused."""
    mesh = folder / "named.obj"
    mesh.write_bytes(NAMED)
    overrides_place(mesh).write_bytes(data)
    found = load_overrides(overrides_place(mesh))
    promise(have_area(found.triangles).all(), "what is drawn has an area")
    product = simplify(load(mesh, ignore=found.ignore), _OPTIONS, overrides=found).measure()
    for warning in product.warnings:
        check_sentence(warning)
    made = product.occluder.vertices[product.occluder.faces]
    promise(_corners(found.triangles) <= _corners(made), "what is drawn is there")
    promise(len(made) <= _OPTIONS.budget, "and counts")
    for one in found.open:
        touch = _TOUCH * float(one.region.half.max())
        promise(not one.region.crossed_by(made, touch).any(), "what is open stays open")


def _corners(triangles: FloatArray) -> set[tuple[bytes, ...]]:
    """Each as its corners, in whatever order; a drawn triangle may be there twice."""
    return {
        tuple(sorted(corner.tobytes() for corner in triangle))
        for triangle in triangles + 0.0  # no negative zeros
    }
