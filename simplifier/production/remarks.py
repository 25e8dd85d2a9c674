"""What users should know of overrides, and of what was left out for them, a sentence each."""

from __future__ import annotations

from typing import Any

from simplifier.accuracy.deviation import deviation_from_solid
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import Overrides
from simplifier.geometry.solid import Solid
from simplifier.io.labels import KEEP, omitted_words

_ROUNDED = 1e-6  # of a region's place and size: formats keep 32 bits of a coordinate


def remarks(
    mesh: TriangleMesh, occluder: Occluder, solid: Solid, overrides: Overrides
) -> tuple[str, ...]:
    """What is left out, drawn parts beyond the error bound, and open regions that are not open."""
    return (*_omission_remarks(mesh), *_sticking_out(mesh, occluder, solid, overrides),
            *_crossing_remarks(occluder, overrides))  # fmt: skip


_LARGE, _SMALL = 5.0, 0.05
"""Times the length of the mesh that no occluder of it has, but by another unit."""


def misplaced(mesh: TriangleMesh, occluder: Occluder) -> tuple[str, ...]:
    """That an occluder, made elsewhere, is nowhere near the mesh, or of another size."""
    if len(occluder.faces) == 0:
        return ()
    corners = occluder.vertices[occluder.faces].reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    first, last = mesh.bounds
    times = float((high - low).max() / mesh.extent.max())
    if times > _LARGE or times < _SMALL:
        size = f"{times:,.0f} times" if times > 1.0 else f"1/{1.0 / times:,.0f}"
        return (f"the occluder is {size} as long as the mesh; check that both have the same unit",)
    if (low > last).any() or (high < first).any():
        return (
            "the occluder lies wholly beside the mesh; check that both have the same unit, up axis"
            " and origin",
        )
    return ()


def overrides_summary(overrides: Overrides) -> dict[str, Any] | None:
    """Drawn parts and open regions as a report has them; None where there are none."""
    if not overrides.drawn and not overrides.open and not len(overrides.viewers):
        return None
    return {
        "drawn": [part.name for part in overrides.drawn],
        "triangles": len(overrides.triangles),
        "open": [one.name for one in overrides.open],
        "viewers": len(overrides.viewers),
    }


def _omission_remarks(mesh: TriangleMesh) -> list[str]:
    if not mesh.omitted:
        return []
    see_through = any(one.see_through for one in mesh.omitted)
    return [omitted_words(mesh.omitted) + (f"; {KEEP}" if see_through else "")]


def _sticking_out(
    mesh: TriangleMesh, occluder: Occluder, solid: Solid, overrides: Overrides
) -> list[str]:
    found = []
    for part in overrides.drawn:
        drawn = Occluder.of(part.triangles, 0.0, {})
        strays = deviation_from_solid(drawn, mesh, solid)
        if strays > occluder.error_bound:
            found.append(
                f"{part} sticks out of the mesh by {strays:.3g}, where it may hide what is visible"
            )
    return found


def _crossing_remarks(occluder: Occluder, overrides: Overrides) -> list[str]:
    triangles = occluder.vertices[occluder.faces]
    found = []
    for one in overrides.open:
        reach = float((abs(one.region.centre) + one.region.half.max()).max())
        count = int(one.region.crossed_by(triangles, _ROUNDED * reach).sum())
        if count:
            verb = "triangle passes" if count == 1 else "triangles pass"
            found.append(f"{count} {verb} through the open region {one}")
    return found
