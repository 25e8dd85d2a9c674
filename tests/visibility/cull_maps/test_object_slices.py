"""Slices of objects: what is hidden of them, and that no point of that is ever seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import generated_city, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.pvs import SLICES, Slices
from simplifier.kernels.object_slices import hidden_blocks
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs, viewpoints
from simplifier.visibility.checking.exact_view import prisms_of
from simplifier.visibility.checking.hidden_parts import HiddenParts, hidden_boxes
from simplifier.visibility.cull_maps.cull_map import CullMaps, see_by_cull_maps, umbra_heights
from simplifier.visibility.cull_maps.object_slices import hidden_parts, slices_by_cull_maps
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.checking.test_check import pvs_of
from tests.visibility.scenes import PUZZLES, puzzle
from tests.visibility.solid.test_height_field import upright
from tests.visibility.solid.test_terrain import terrain_of
from tests.visibility.test_find import city_and_cells


def maps_of(scene, cells, pixel=0.5, spacing=1.0):
    around = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    return CullMaps(height_field(upright(scene), pixel, around), spacing)


def sliced(scene, cells, pixel=0.5, spacing=1.0):
    """(c, n) what may be visible, and (c, n, 3) its slices."""
    maps = maps_of(scene, cells, pixel, spacing)
    return slices_by_cull_maps(maps, cells, see_by_cull_maps(maps, cells)[0], scene.bounds())


def slices_of(puzzle, name, **given):
    seen, slices = sliced(puzzle.scene, puzzle.cells, **given)
    index = puzzle.scene.names.index(name)
    assert seen[0, index]
    return slices[0, index].tolist()


# 40 m high and 30 m away, the eyes 2 m up.  Over a wall of 10 m, 15 m away, the far edge of the
# cell sees what is above 2 + 8 / 20 * 35 = 16 m: three slices of 5 m are hidden.
SCREEN = ((30.05, 30.3), (-8.0, 8.0), 40.0)  # so thin that it hides nothing of itself


def test_a_low_wall_before_a_tall_tower_hides_its_lowest_slices_alone():
    scene = puzzle({"wall": ((15.0, 17.0), (-60.0, 60.0), 10.0), "screen": SCREEN})
    x, y, z = slices_of(scene, "screen", pixel=0.15, spacing=0.3)
    assert z == 4  # the first that is drawn
    assert (x, y) == (0, 0)


@pytest.mark.parametrize(
    ("wall", "value"),
    [
        # From (5, 5) lines past the wall's end go on to y = 2 - 3 / 10.5 * 14.8 = -2.2: of the
        # slices of 2 m two are hidden.
        (((14.5, 15.5), (-60.0, 2.0), 90.0), -2),
        (((14.5, 15.5), (-2.0, 60.0), 90.0), 6),
    ],
)
def test_a_wall_at_one_side_hides_the_slices_of_that_side(wall, value):
    cell = puzzle({"wall": wall, "screen": SCREEN})
    assert slices_of(cell, "screen", pixel=0.15, spacing=0.3) == [0, value, 0]


def test_what_nothing_stands_before_shows_its_front():
    scene = puzzle({"house": ((30.0, 46.0), (-20.0, 20.0), 40.0)})
    # Its own walls hide what is behind them: three slices of 2 m are drawn.
    assert slices_of(scene, "house") == [3, 0, 0]


def test_what_stands_in_a_cell_and_what_is_not_visible_has_no_hidden_slice():
    boxes = {
        "inside": ((-1.0, 1.0), (-1.0, 1.0), 1.0),
        "wall": ((15.0, 19.0), (-60.0, 60.0), 30.0),
        "behind": ((30.0, 32.0), (-5.0, 5.0), 10.0),
    }
    scene = puzzle(boxes)
    seen, slices = sliced(scene.scene, scene.cells)
    assert seen[0].tolist() == [True, True, False]
    assert slices[0, 0].tolist() == slices[0, 2].tolist() == [0, 0, 0]
    assert slices[0, 1].any()


def parts_by_umbra(maps, cells, cell, index, box):
    """Algorithm 2 from a cull map of the whole raster, pixel by pixel."""
    field, umbra = maps.field, umbra_heights(maps, cells, cell)
    parts = np.full((SLICES, SLICES), np.inf)
    for pixel in range(len(field.starts) - 1):
        x, y = divmod(pixel, field.shape[1])
        for item in range(field.starts[pixel], field.starts[pixel + 1]):
            if field.objects[item] == index and field.object_tops[item] > umbra[x, y] - 1e-9:
                low = field.low + field.cell * np.array([x, y])
                ends = (np.array([low, low + field.cell]) - box[0, :2]) / (box[1] - box[0])[:2]
                first, last = np.clip(
                    np.floor(SLICES * ends + [[-1e-9], [1e-9]]).astype(int), 0, SLICES - 1
                )
                part = parts[first[0] : last[0] + 1, first[1] : last[1] + 1]
                np.minimum(part, umbra[x, y], out=part)
    return parts


@pytest.mark.parametrize("seed", [0, 1])
def test_parts_are_as_low_as_the_umbra_over_them(seed):
    city = generated_city(2, seed=seed)
    cells = street_cells(city, 2, seed=seed)
    maps = maps_of(city, cells, 2.0, 10.0)
    seen = see_by_cull_maps(maps, cells)[0]
    boxes = city.bounds()
    parts, owners, objects = hidden_parts(maps, cells, seen, boxes, np.zeros_like(seen))
    assert np.array_equal(np.stack([owners, objects]), np.nonzero(seen))
    for part, cell, index in zip(parts, owners.tolist(), objects.tolist(), strict=True):
        expected = parts_by_umbra(maps, cells, cell, index, boxes[index])
        lowest = boxes[index, 0, 2] + (boxes[index, 1] - boxes[index, 0])[2] / SLICES
        # Where nothing of the lowest slice is hidden, rays towards the object are not followed on.
        if expected.max() >= lowest:
            assert part == pytest.approx(expected, abs=1e-9)
        else:
            assert part.max() < lowest
    assert 0.1 < np.isfinite(parts).mean() < 0.9


def block_by_brute_force(counts, size, height):
    """Algorithm 3 for corners of the plan, in the order of the kernel: area and three numbers."""
    best, numbers = 0.0, (0, 0, 0)
    for x_side in (False, True):
        for y_side in (False, True):
            for wide in range(1, SLICES + 1):
                for deep in range(1, SLICES + 1):
                    x = slice(SLICES - wide, None) if x_side else slice(wide)
                    y = slice(SLICES - deep, None) if y_side else slice(deep)
                    tall = counts[x, y].min()
                    w, d, h = wide * size[0] / 8, deep * size[1] / 8, tall * height / 8
                    area = w * h * (1 + (deep == 8)) + d * h * (1 + (wide == 8))
                    area += w * d * (tall == 8)
                    if tall and area > best * (1 + 1e-9):
                        best = area
                        ends = [
                            0 if n == 8 else 8 - n if side else -n
                            for n, side in ((wide, x_side), (deep, y_side))
                        ]
                        numbers = (*ends, tall)
    return numbers


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_the_largest_block_is_found_as_by_trying_all(seed, open_share):
    random = np.random.default_rng(seed)
    # Stairs, as shadows leave them, with holes.
    slope = random.normal(size=2)
    steps = slope[0] * np.arange(SLICES)[:, None] + slope[1] * np.arange(SLICES)
    counts = np.clip(np.floor(4.0 + steps + random.normal(size=(8, 8))), 0, 8).astype(int)
    counts[random.random((8, 8)) < 0.1 * open_share] = 0
    low, height, size = random.normal(), random.uniform(1.0, 30.0), random.uniform(1.0, 20.0, 2)
    heights = low + height * (counts + 0.5) / SLICES
    heights[(counts == SLICES) & (random.random((8, 8)) < 0.5)] = np.inf
    blocks = np.zeros((1, 3), dtype=np.int8)
    hidden_blocks(0, 1, heights[None], np.array([low]), np.array([height]), size[None], blocks)
    assert blocks[0].tolist() == list(block_by_brute_force(counts, size, height))


def test_the_same_on_any_number_of_threads_and_in_any_company(monkeypatch):
    city = generated_city(3, seed=4)
    cells = street_cells(city, 5, seed=4)
    seen, slices = sliced(city, cells, 1.0, 2.0)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    monkeypatch.setattr("simplifier.visibility.cull_maps.object_slices._PAIRS", 50)
    for other, expected in zip(sliced(city, cells, 1.0, 2.0), (seen, slices), strict=True):
        assert np.array_equal(other, expected)
    alone = sliced(city, cells.some(np.array([3])), 1.0, 2.0)
    assert np.array_equal(alone[1][0], slices[3])


def leaks(scene, cells, seen, slices, views=25):
    """Objects of which a viewpoint of a cell sees what is hidden, by cell."""
    starts = np.concatenate([[0], np.cumsum(seen.sum(axis=1))])
    pvs = replace(pvs_of(scene, cells, list(seen)), slices=Slices(starts, slices[seen]))
    parts = HiddenParts(scene, pvs, prisms_of(scene, "z"))
    random = np.random.default_rng(0)
    found = [
        parts.seen_from(cell, viewpoints(cells, cell, views, random)) for cell in range(len(cells))
    ]
    return [(cell, index) for cell, row in enumerate(found)
            for index in np.flatnonzero(~np.isnan(row).all(axis=0)).tolist()]  # fmt: skip


@pytest.mark.parametrize("make", PUZZLES)
@pytest.mark.parametrize("pixel", [0.25, 1.0])
def test_nothing_hidden_is_seen_in_scenes_built_against_it(make, pixel):
    puzzle = make()
    scene, cells = puzzle.scene, puzzle.cells
    assert leaks(scene, cells, *sliced(scene, cells, pixel, 2.5)) == []


@pytest.mark.parametrize(("seed", "pixel", "blocks"), [(0, 1.0, 5), (1, 0.5, 4), (2, 2.0, 5)])
def test_slices_hide_half_of_what_is_visible_and_nothing_that_is_seen(seed, pixel, blocks):
    city = generated_city(blocks, seed=seed)
    cells = street_cells(city, 4, seed=seed)
    seen, slices = sliced(city, cells, pixel, 2.0 * pixel)
    boxes = city.bounds()[np.nonzero(seen)[1]]
    hidden = hidden_boxes(boxes, slices[seen])
    shares = np.nan_to_num(np.prod(np.diff(hidden, axis=1) / np.diff(boxes, axis=1), axis=(1, 2)))
    assert shares.mean() > 0.5
    assert leaks(city, cells, seen, slices) == []


@pytest.mark.parametrize(("placing", "fill"), [("boxes", "viewers"), ("triangles", "outside")])
def test_other_cells_and_other_solids_have_slices_too(placing, fill):
    upright, cells = city_and_cells(3, 5, seed=2)
    options = PvsOptions(up="z", epsilon=2.5, slices=True, fill=fill)
    if placing == "triangles":
        cells = place_cells(upright, "triangles", options)
        cells = cells.some(np.arange(0, len(cells), 90))
    pvs = find_pvs(upright, cells, options).pvs
    assert (pvs.slices.values != 0).any(axis=1).mean() > 0.8
    assert not check_pvs(upright.scene, pvs, CheckOptions(views=20, azimuths=90)).leaks


def test_slices_are_kept_apart_from_sets_without_any_and_refused_where_there_are_none():
    upright, cells = city_and_cells(2, 4)
    plain, sliced = PvsOptions(up="z"), PvsOptions(up="z", slices=True)
    before = find_pvs(upright, cells, plain).pvs
    assert before.slices is None
    found = find_pvs(upright, cells, sliced, before)
    assert found.made == len(cells)
    again = find_pvs(upright, cells, sliced, found.pvs)
    assert again.made == 0
    assert np.array_equal(again.pvs.slices.values, found.pvs.slices.values)
    for other in ("slice-wise", "strong"):
        with pytest.raises(OptionError, match="have no --slices"):
            find_pvs(upright, cells, replace(sliced, method=other))
    with pytest.raises(OptionError, match="OpenGL finds none"):
        find_pvs(upright, cells, replace(sliced, backend="opengl"))
    terrain = terrain_of(np.zeros((5, 5)), (10.0, 10.0), 2)
    hill = UprightScene.of(terrain.scene, "z")
    with pytest.raises(OptionError, match="drawn as wholes"):
        find_pvs(hill, cells, sliced, terrain=terrain)


def test_slices_are_those_of_the_cells_axes_whichever_is_up():
    upright, cells = city_and_cells(2, 4)
    turn = np.zeros((4, 4))
    turn[[1, 2, 0, 3], [0, 1, 2, 3]] = 1.0  # x is up
    scene = upright.scene
    there = replace(scene, transforms=turn @ scene.transforms)
    near = find_pvs(upright, cells, PvsOptions(up="z", slices=True)).pvs
    far = find_pvs(UprightScene.of(there, "x"), cells, PvsOptions(up="x", slices=True)).pvs
    assert np.array_equal(near.slices.values, far.slices.values)
    assert not check_pvs(there, far, CheckOptions(cells=4, views=10, azimuths=20)).leaks
