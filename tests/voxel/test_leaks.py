"""The warning about leaks: open vessels, and shapes that only look like them."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.io.load import load
from simplifier.voxel.fill import fill
from simplifier.voxel.leaks import leaks
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, joined, sphere, table

GROUND = frozenset({(1, 0)})
NO_SIDE = frozenset()


def leak(mesh, resolution=32, closed=NO_SIDE):
    touched = voxelize(mesh, resolution)
    return leaks(touched, fill(touched, closed))


# Once only voxels with the surface on all six sides counted: no open box has any.
@pytest.mark.parametrize("side", range(6))
@pytest.mark.parametrize("resolution", [8, 16, 64])
def test_a_box_without_a_side_leaks(side, resolution):
    assert leak(box(without=[side]), resolution)


def test_the_ground_closes_it():
    # Side 2 is -y, the ground of a y-up asset; closing another side is of no use.
    assert not leak(box(without=[2]), closed=GROUND)
    assert leak(box(without=[3]), closed=GROUND)


def test_a_slot_is_enough():
    sides = [box((1, 1, 0.01), (0, 0, z)) for z in (0.0, 0.99)]
    sides += [box((0.01, 1, 1), (x, 0, 0)) for x in (0.0, 0.99)]
    floor = [box((1, 0.01, 0.6)), box((1, 0.01, 0.3), (0, 0, 0.7))]
    lid = box((1, 0.01, 1), (0, 0.99, 0))
    assert leak(joined(*sides, *floor, lid))
    assert not leak(joined(*sides, box((1, 0.01, 1)), lid))


@pytest.mark.parametrize(
    "mesh", [box(), sphere(), table(), joined(box(), box((1, 1, 1), (3, 0, 0)))]
)
@pytest.mark.parametrize("resolution", [8, 32, 64])
def test_closed_meshes_do_not(mesh, resolution):
    assert not leak(mesh, resolution)


def test_sheets_do_not():
    assert not leak(box((1, 0, 1), without=[0, 1, 3, 4, 5]))
    x, z = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20))
    hills = [
        box((0.06, 0.001, 0.06), (a, 0.15 * np.sin(7 * a) * np.cos(5 * b), b))
        for a, b in zip(x.ravel(), z.ravel(), strict=True)
    ]
    assert not leak(joined(*hills))


def test_a_closed_part_is_enough_to_be_silent():
    # One of two vessels is open: more is inside than nothing, so the words would be wrong.
    assert not leak(joined(box(), box((1, 1, 1), (2, 0, 0), without=[2])))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("bunny_4968.ply", True),
        ("broken_lyon_palais_de_justice.ply", True),
        ("dragon_871k.ply", False),
        ("buddha_113k.ply", False),
        ("terrain_jacksboro_60160.ply", False),
        ("tree_aspen_leafless.glb", False),
    ],
)
def test_assets(asset, name, expected):
    assert leak(load(asset(name)), 64) == expected


def test_the_bunny_on_the_ground_does_not_leak(asset):
    assert not leak(load(asset("bunny_4968.ply")), 64, GROUND)
