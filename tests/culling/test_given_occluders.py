"""Occluders that were made elsewhere: drawn as they are, and judged as those of a tree."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.culling.flythrough import fly
from simplifier.culling.given_occluders import GivenCuller
from simplifier.errors import SceneError
from simplifier.hierarchy.parts import split_large
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from tests.culling.occluded import (
    HIDDEN,
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    street,
    tree_of,
)
from tests.solids import box
from tests.walkable import scene_of


def test_a_wall_hides_what_the_same_wall_in_a_tree_hides():
    scene = street()
    parts = split_large(scene)
    given = GivenCuller(scene_of(WALL), parts.bounds, DepthBuffer(45, 80))
    tree = Culler(tree_of(scene, {"wall": exact(WALL)}), DepthBuffer(45, 80))
    for camera in (looking(), looking((3.0, -20.0, 3.0)), looking((0.0, 20.0, 3.0))):
        one, other = given.cull(camera), tree.cull(camera)
        np.testing.assert_array_equal(one.verdicts, other.verdicts)
        assert one.triangles == other.triangles
        np.testing.assert_array_equal(given.in_frustum(camera), tree.in_frustum(camera))


def test_what_is_hidden_by_then_is_not_drawn():
    """From near to far, in whatever order they come."""
    behind = box((1.0, 1.0, 1.0), (-0.5, 6.0, 2.5))
    parts = split_large(street())
    given = GivenCuller(scene_of(behind, WALL), parts.bounds, DepthBuffer(45, 80))
    assert [index for index, _ in given.cull(looking()).drawn] == [1]
    from_behind = given.cull(looking((0.0, 30.0, 3.0), (0.0, -1.0, 0.0)))
    assert [index for index, _ in from_behind.drawn] == [0, 1]


def test_a_walk_is_counted_with_wrong_pixels_where_they_cover_too_much():
    scene = street()
    exactly = fly(scene, scene_of(WALL), path_of(), SMALL).total
    assert exactly.parts.culled == len(HIDDEN)
    assert exactly.wrong_pixels == 0
    wide = box((40.0, 0.2, 20.0), (-20.0, 0.0, -6.0))
    assert fly(scene, scene_of(wide), path_of(), SMALL).total.wrong_pixels > 0


def test_occluders_beside_the_scene_are_refused():
    aside = box((1.0, 1.0, 1.0), (900.0, 0.0, 0.0))
    with pytest.raises(SceneError, match="beside the scene"):
        fly(street(), scene_of(aside), path_of(), SMALL)


def test_the_command_takes_a_file_of_them(tmp_path, here):
    write_scene(street(), tmp_path / "street.glb")
    write_scene(scene_of(WALL, names=["by hand"]), tmp_path / "wall.glb")
    assert len(load_scene(tmp_path / "wall.glb")) == 1
    done = here(
        "path", tmp_path / "street.glb", "-o", tmp_path / "walk.json", "--up", "z",
        "--kind", "roof", "--frames", "3",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    done = here(
        "cull", tmp_path / "street.glb", "--occluders", tmp_path / "wall.glb", "--path",
        tmp_path / "walk.json", "-o", tmp_path / "out", "--image", "80x45",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "cull.json").is_file()
