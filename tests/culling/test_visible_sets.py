"""Sets are looked up for the very scene that they were found in, and for no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.culling.visible_sets import VisibleSets, check_sets
from simplifier.errors import SceneError
from tests.culling.occluded import sets_of, street
from tests.walkable import moved


def test_what_is_seen_from_a_cell_and_from_outside():
    scene = street()
    held = VisibleSets.of(sets_of(scene, ["wall", "beside"]), scene, scene)
    seen = held.seen_from(np.array([0.0, -10.0, 3.0]))
    assert [name for name, one in zip(scene.names, seen, strict=True) if one] == ["wall", "beside"]
    assert held.holds(np.array([0.0, -10.0, 3.0]))
    for away, within in (([0.0, -10.0, 4.1], False), ([5.0, -10.0, 3.0], True)):  # not computed
        assert held.seen_from(np.array(away)).all()
        assert held.holds(np.array(away)) == within


def test_objects_are_known_by_name_where_glass_is_not_drawn():
    scene = street()
    kept = np.array([name != "wall" for name in scene.names])
    drawn = replace(
        scene, names=tuple(np.array(scene.names)[kept]), mesh_of=scene.mesh_of[kept],
        transforms=scene.transforms[kept],
    )  # fmt: skip
    pvs = sets_of(scene, ["wall", "behind 2"], opaque=drawn)
    seen = VisibleSets.of(pvs, scene, drawn).seen_from(np.array([0.0, -10.0, 3.0]))
    assert [name for name, one in zip(drawn.names, seen, strict=True) if one] == ["behind 2"]
    more = replace(drawn, names=("unheard of", *drawn.names[1:]))
    pvs = sets_of(scene, ["behind 2"], opaque=more)
    assert VisibleSets.of(pvs, scene, more).seen_from(np.array([0.0, -10.0, 3.0]))[0]


def test_sets_of_another_scene():
    scene = street()
    pvs = sets_of(scene, ["wall"])
    check_sets(pvs, scene)
    renamed = replace(scene, names=("gate", *scene.names[1:]))
    for other in (renamed, moved(scene, (0.0, 0.0, 1e-9))):
        with pytest.raises(SceneError, match="find them again with 'occluder pvs'"):
            VisibleSets.of(pvs, other, other)
