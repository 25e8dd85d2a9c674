"""Viewers inside: what they see stays open, whatever is closed off from outside."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier
from simplifier.geometry.overrides import Overrides
from simplifier.options.stages import SolidOptions
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solid_decisions, solid_warnings, solidify
from tests.solids import box, joined

LONG, DEEP, HIGH, THICK = 9.0, 6.0, 3.6, 0.6
ROOM = np.array([[THICK, THICK, THICK], [LONG - THICK, DEEP - THICK, HIGH - THICK]])


def slab(low, high):
    return box(np.subtract(high, low), low)


def house(window=0.0):
    """Six slabs around a room, z up; hollow each, as modelled walls are.  ``window`` wide."""
    inner = HIGH - THICK
    gap = 0.5 * (LONG - window)
    walls = [
        slab((0, 0, 0), (LONG, DEEP, THICK)),
        slab((0, 0, inner), (LONG, DEEP, HIGH)),
        slab((0, 0, THICK), (THICK, DEEP, inner)),
        slab((LONG - THICK, 0, THICK), (LONG, DEEP, inner)),
        slab((THICK, DEEP - THICK, THICK), (LONG - THICK, DEEP, inner)),
        slab((THICK, 0, THICK), (gap, THICK, inner)),
        slab((LONG - gap, 0, THICK), (LONG - THICK, THICK, inner)),
    ]
    return joined(*walls)


def solid_of(mesh, overrides=None, **options):
    chosen = SolidOptions(**{"resolution": 64, "up": "z", **options})
    solid = solidify(mesh, chosen, Stopwatch(), overrides or Overrides())
    return solid, chosen


def filled_share(solid, low, high):
    """Of the voxels of a box in world units, less a voxel at its sides."""
    first, last = (np.round(solid.filled.to_grid(np.asarray(p))).astype(int) for p in (low, high))
    part = tuple(slice(a + 1, b - 1) for a, b in zip(first, last, strict=True))
    return solid.filled.inside[part].mean()


@pytest.mark.parametrize("window", [0.0, 1.2])
@pytest.mark.parametrize("fill", ["sight", "flood"])
def test_a_room_stays_open_and_walls_stay_filled(window, fill):
    mesh = house(window)
    solid, options = solid_of(mesh, viewers="inside", fill=fill, resolution=48)
    assert filled_share(solid, *ROOM) == 0.0
    assert filled_share(solid, (THICK, DEEP - THICK, THICK), (LONG, DEEP, HIGH - THICK)) == 1.0
    assert any("stays open because viewers inside see it" in one
               for one in solid_decisions(solid, options))  # fmt: skip
    assert not any("viewers inside" in one for one in solid_warnings(mesh, solid, options))


def test_without_them_the_same_room_is_filled():
    solid, options = solid_of(house(0.3))
    assert filled_share(solid, *ROOM) == 1.0
    assert solid.opened == 0
    assert not any("viewers inside" in one for one in solid_decisions(solid, options))


@pytest.mark.parametrize("conservative", [False, True])
def test_a_place_that_someone_looks_from_opens_what_it_sees(conservative):
    """A shaft in a block, and a viewer in it: no floor to stand on is needed."""
    block = joined(box((4.0, 4.0, 4.0)), box((1.0, 1.0, 1.0), (1.5, 1.5, 1.5)))
    eye = Overrides(viewers=np.array([[2.0, 2.0, 2.0]]))
    closed, _ = solid_of(block, conservative=conservative)
    opened, _ = solid_of(block, eye, conservative=conservative)
    low, high = (1.5,) * 3, (2.5,) * 3
    assert filled_share(closed, low, high) == 1.0
    assert filled_share(opened, low, high) == 0.0
    assert opened.opened == closed.filled.count - opened.filled.count > 0
    assert not opened.core.inside[opened.filled.inside == 0].any()


def test_where_nobody_can_stand_the_user_is_told():
    """A box is too low for them, and one of thousands of units too tall."""
    for mesh in (box((1.0, 1.0, 1.0)), box((9e4, 6e4, 4e4))):
        solid, options = solid_of(mesh, viewers="inside", eye_height=1.7)
        assert solid.opened == 0
        (warning,) = [
            one for one in solid_warnings(mesh, solid, options) if "viewers inside" in one
        ]
        assert "check the up axis, the eye height" in warning


def test_what_is_made_keeps_out_of_the_room():
    """The room's middle: nothing of the occluder comes nearer than its error bound allows.

    With more triangles than 24 the walls would be kept as they are.
    """
    mesh = house(1.2)
    found = simplifier.simplify(
        mesh, up="z", viewers="inside", budget=24, preset="draft", resolution=45, moves=3000
    )
    middle = np.array([ROOM[0] + 1.0, ROOM[1] - 1.0])
    triangles = found.occluder.vertices[found.occluder.faces]
    weights = np.random.default_rng(0).dirichlet((1.0, 1.0, 1.0), 4000)
    points = np.einsum("kc,mcd->mkd", weights, triangles).reshape(-1, 3)
    assert not ((points > middle[0]) & (points < middle[1])).all(axis=1).any()
    filled = simplifier.simplify(
        mesh, up="z", budget=24, preset="draft", moves=0, smallest_hole=1.5
    )
    triangles = filled.occluder.vertices[filled.occluder.faces]
    points = np.einsum("kc,mcd->mkd", weights, triangles).reshape(-1, 3)
    assert ((points > middle[0]) & (points < middle[1])).all(axis=1).any()
