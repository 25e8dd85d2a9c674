"""What the warning about leaks advises, and that the advice is true."""

from __future__ import annotations

import re

import pytest

from simplifier.io.load import load
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from simplifier.voxel.fill import enclose, fill
from simplifier.voxel.leaks import Remedy, leak_warning, remedies
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, joined

NOTHING = frozenset()


def found_for(mesh, resolution=40, sides=NOTHING, hole=0.0):
    touched = voxelize(mesh, resolution)
    filled, _ = enclose(touched, sides, hole)
    return remedies(touched, filled, sides, hole), touched


@pytest.mark.parametrize("side", range(6))
def test_a_box_without_a_side_stands_on_it(side):
    (remedy,), touched = found_for(box(without=[side]))
    assert remedy.ground == (side // 2, -(side % 2))
    assert remedy.hole == 0.0
    grounded = fill(touched, frozenset({remedy.ground}))
    assert remedy.share == pytest.approx((grounded.count - touched.count) / touched.inside.size)
    assert remedy.share > 0.8


def gapped(gap):
    """A unit box with a gap of that width across its lid."""
    half = (1.0 - gap) / 2.0
    flaps = [
        box((half, 0.0, 1.0), (x, 1.0, 0.0), without=[0, 1, 2, 4, 5]) for x in (0.0, half + gap)
    ]
    return joined(box(without=[3]), *flaps)


@pytest.mark.parametrize(("voxels", "least"), [(3.6, 2), (5.6, 4), (9.6, 8)])
def test_the_least_hole_that_helps_is_named(voxels, least):
    turned_over, hole = found_for(gapped(voxels / 40))[0]
    assert turned_over.ground == (1, -1)
    assert hole.ground is None
    assert least <= 40 * hole.hole <= 1.1 * least


def test_a_larger_hole_than_the_one_that_did_not_help():
    found = found_for(gapped(5.6 / 40), hole=2.0)[0]
    assert [remedy.hole for remedy in found] == [0.0, 0.1]


def test_nothing_helps_where_a_wall_and_a_half_are_missing():
    panel = box((0.0, 1.0, 0.5), (1.0, 0.0, 0.0), without=[1, 2, 3, 4, 5])
    helps, touched = found_for(joined(box(without=[0, 1]), panel))
    assert helps == []
    warning = leak_warning(touched, touched, NOTHING, 0.0)
    assert "neither ground nor a smallest hole of 8 voxels closes it" in warning
    assert "lower resolution" in warning


def test_words():
    assert Remedy((2, 0), 0.0, 0.4149).advice == "ground with up z (closes 41 % of the grid)"
    assert Remedy((1, -1), 0.0, 0.5).advice.startswith("turned over, ground with up y (")
    assert Remedy(None, 0.12, 0.3).advice == "smallest hole 0.12 (closes 30 % of the grid)"


def check_advice(mesh, resolution=64):
    """Whatever is advised in words does what it says."""
    longest = float(mesh.extent.max())
    quick = {
        "preset": "draft", "moves": 0, "budget": 4, "resolution": resolution, "fill": "flood",
    }  # fmt: skip
    result = simplify_mesh(mesh, make_options(longest, **quick))
    (warning,) = [
        words for words in result.warnings if words.startswith("the mesh is not watertight")
    ]
    advised = re.findall(
        r"(?:try|or) (ground with up \w|smallest hole \S+) \(closes (\d+) %", warning
    )
    for words, share in advised:
        name, value = words.split()[0], words.split()[-1]
        more = (
            {"ground": True, "up": value} if name == "ground" else {"smallest_hole": float(value)}
        )
        closed = simplify_mesh(mesh, make_options(longest, **quick, **more))
        gained = closed.solid.inside_fraction - result.solid.inside_fraction
        assert gained == pytest.approx(int(share) / 100.0, abs=0.0051)
        assert not any(words.startswith("the mesh is not watertight") for words in closed.warnings)
    return [words for words, _ in advised]


@pytest.mark.parametrize("scale", [1e-5, 1.0, 3e7])
def test_advice_is_true_at_any_scale(scale):
    mesh = gapped(0.05)
    mesh = type(mesh).from_soup(mesh.vertices * scale, mesh.faces)
    (words,) = check_advice(mesh)
    assert words.startswith("smallest hole")


def test_the_bunny(asset):
    assert check_advice(load(asset("bunny_4968.ply"))) == [
        "ground with up y", "smallest hole 0.2",
    ]  # fmt: skip


def test_a_city_hall_without_floors(asset):
    (words,) = check_advice(load(asset("broken_lyon_palais_de_justice.ply")))
    assert words.startswith("smallest hole")


def test_rooms_of_a_game_level(asset):
    (words,) = check_advice(load(asset("level_dungeon.ply")))
    assert words.startswith("smallest hole")
