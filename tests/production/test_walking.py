"""Walks that are recorded for a page, through scenes of which nothing is known."""

from __future__ import annotations

import gzip
import json
import threading
from dataclasses import replace

import numpy as np
import pytest

import simplifier
from tests.culling.occluded import WALL, exact, street, tree_of


def header(data):
    plain = gzip.decompress(data)
    return json.loads(plain[8 : 8 + int.from_bytes(plain[4:8], "little")])


@pytest.fixture(scope="module")
def town():
    scene = street()
    return scene, tree_of(scene, {"wall": exact(WALL)}, up="z")


def test_the_same_scene_gives_the_same_bytes(town):
    made = [simplifier.record_walk(*town, name="town.glb", frames=5) for _ in range(2)]
    assert made[0] == made[1]
    told = header(made[0])
    assert (told["scene"], told["frames"], told["up"]) == ("town.glb", 5, 2)
    assert len(told["figures"]["hidden"]) == 5


@pytest.mark.parametrize("scale", [1e-3, 1e3], ids=["kilometres", "millimetres"])
def test_a_scene_in_other_units_is_walked_through_as_well(town, scale):
    scene, tree = town
    placed = scene.transforms.copy()
    placed[:, :3] *= scale
    other = replace(scene, transforms=placed)
    tree = tree_of(other, {}, up="z")
    assert header(simplifier.record_walk(other, tree, frames=3))["frames"] == 3


def test_it_ends_when_it_is_cancelled_and_refuses_occluders_of_another_scene(town):
    scene, tree = town
    cancel = threading.Event()
    cancel.set()
    with pytest.raises(simplifier.CancelledError):
        simplifier.record_walk(scene, tree, frames=5, cancel=cancel)
    fewer = scene.some(np.arange(len(scene)) < 3)
    with pytest.raises(simplifier.SceneError, match="another scene"):
        simplifier.record_walk(fewer, tree, frames=5)
    with pytest.raises(simplifier.OptionError):
        simplifier.record_walk(scene, tree, frames=0)
