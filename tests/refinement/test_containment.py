"""Which triangles keep to which room."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.refinement.containment import are_inside, narrowest_room
from simplifier.steps.room import open_room
from simplifier.steps.solid import solidify
from tests.solids import sphere


@pytest.fixture(scope="module")
def room():
    mesh, options = sphere(), make_options(2.0, resolution=24)
    return open_room(mesh, solidify(mesh, options.solid, Stopwatch()), options)


def at(room, limit):
    """A small triangle that keeps to so many layers, and to no fewer."""
    chance = np.random.default_rng(limit)
    places = chance.uniform(0.0, 1.0, (10_000, 1, 3)) * np.array(room.shape)
    triangles = places + 1e-3 * np.eye(3)
    fewer = are_inside(triangles, room.up_to(limit - 1))
    return triangles[are_inside(triangles, room.up_to(limit)) & ~fewer][0]


def test_the_narrowest_room_holds_all_of_a_soup_and_no_narrower_one_does(room):
    assert room.limit >= 3
    soup = np.stack([at(room, 1), at(room, 3), at(room, 2)])
    assert narrowest_room(soup, room.up_to(1), room.limit).limit == 3
    assert narrowest_room(soup[:1], room.up_to(1), room.limit).limit == 1
    assert narrowest_room(soup[:1], room.up_to(2), room.limit).limit == 2
    assert narrowest_room(soup[:0], room.up_to(1), room.limit).limit == 1
    assert narrowest_room(soup, room.up_to(1), 3).limit == 3
