"""What no cell reaches: solid where it is closed, and nowhere that anyone can look into."""

from __future__ import annotations

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import find_pvs, settings_digest
from simplifier.visibility.solid.height_field import height_field
from simplifier.visibility.solid.viewer_fill import fill_by_viewers
from tests.solids import box
from tests.visibility.scenes import PUZZLES
from tests.visibility.sheets import house, house_with_hole, post, quad, scene_of

AROUND = [
    np.array([[x, y, 0.0], [x + 10.0, y + 10.0, 2.0]])
    for x, y in ((-5.0, -5.0), (80.0, -5.0), (20.0, 40.0), (20.0, -50.0))
]
"""Boxes of cells on all sides of what stands around (30, 0)."""

PIXEL = 0.5


def upright_of(scene):
    return UprightScene(scene, np.arange(3, dtype=np.int32), np.zeros(3), scene.bounds())


def cells_of(boxes):
    return ViewCells.boxes(*np.array(boxes).transpose(1, 0, 2))


def filled_of(sheets, boxes, eye=None, pixel=PIXEL):
    """The filled field, and the one by objects alone."""
    scene = sheets if hasattr(sheets, "names") else scene_of(sheets)
    upright, cells = upright_of(scene), cells_of(boxes)
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    field = height_field(upright, pixel, plan, eye is not None)
    return fill_by_viewers(field, upright, cells, eye), field


def inner_of(sheets):
    """Heights alone, by larger pixels: leaks take longer."""
    with mock.patch("simplifier.visibility.solid.viewer_fill.find_leaks", return_value=((), 0)):
        return filled_of(sheets, AROUND, pixel=1.0)[0].field


def at(field, x, y):
    i, j = np.floor((np.array([x, y]) - field.low) / field.cell).astype(int)
    return field.inner[i, j]


def hidden(sheets, boxes, **options):
    """By cell the names that are in no set, and what was found."""
    scene = scene_of(sheets)
    chosen = PvsOptions(**{"up": "z", "epsilon": 2.5, "fill": "viewers", **options})
    found = find_pvs(upright_of(scene), cells_of(boxes), chosen)
    names = np.array(scene.names)
    return [set(names[~found.pvs.visible(cell)].tolist()) for cell in range(len(boxes))], found


def test_a_house_of_sheets_hides_what_is_behind_it_and_that_is_proven():
    sheets = house("house", (20.0, -20.0, 0.0), (36.0, 20.0, 9.0)) | post()
    sets, found = hidden(sheets, AROUND)
    assert sets[0] == {"house east", "post"}
    assert sets[1] == {"house west"}
    assert found.pvs.conservative
    assert hidden(sheets, AROUND, fill="outside")[0] == [set()] * 4
    filled, outside = filled_of(sheets, AROUND)
    assert at(outside, 28.0, 0.0) == -np.inf
    assert at(filled.field, 28.0, 0.0) == pytest.approx(9.0)
    assert at(filled.field, 28.0, 0.0) <= 9.0
    assert at(filled.field, 19.7, 0.0) == -np.inf
    check = check_pvs(scene_of(sheets), found.pvs, CheckOptions(views=20, pictures=3, pixels=128))
    assert not check.leaks


@pytest.mark.parametrize("hole", [(-1.0, 1.0, 3.0, 5.0), (-5.0, 5.0, 0.0, 3.0)])
def test_a_hole_opens_a_house_and_no_other(hole):
    sheets = house_with_hole(hole=hole) | house("next", (20.0, 15.0, 0.0), (36.0, 35.0, 9.0))
    filled, _ = filled_of(sheets | post(), AROUND)
    assert at(filled.field, 28.0, 0.0) == -np.inf
    assert at(filled.field, 28.0, 25.0) == pytest.approx(9.0)
    sets, found = hidden(sheets | post(), AROUND)
    assert "post" not in sets[0]
    check = check_pvs(found.pvs and scene_of(sheets | post()), found.pvs, CheckOptions(views=20))
    assert not check.leaks


def test_facades_without_backs_are_not_solid():
    facade = {
        "front": quad((20, -20, 0), (20, 20, 0), (20, 20, 9), (20, -20, 9)),
        "left": quad((20, 20, 0), (28, 20, 0), (28, 20, 9), (20, 20, 9)),
        "right": quad((20, -20, 0), (28, -20, 0), (28, -20, 9), (20, -20, 9)),
    }
    filled, _ = filled_of(facade | post(), AROUND)
    assert at(filled.field, 24.0, 0.0) == -np.inf
    assert (filled.field.inner > 0.0).sum() <= 16  # the post
    assert filled.conservative
    roofless = house("yard", (20.0, -10.0, 0.0), (36.0, 10.0, 9.0), ("floor", "roof"))
    tower = {"tower": box((2.0, 2.0, 20.0), (60.0, 0.0, 0.0))}
    assert at(filled_of(roofless | tower, AROUND)[0].field, 28.0, 0.0) == -np.inf
    # Nothing is higher: no line of sight to anything leads over the walls into the yard.
    assert at(filled_of(roofless | post(), AROUND)[0].field, 28.0, 0.0) == pytest.approx(9.0)


def test_walls_between_rooms_are_solid_where_closed_pieces_do_not_prove_it():
    row = house("a", (20.0, -20.0, 0.0), (36.0, 0.2, 9.0))
    row |= house("b", (20.0, 0.2, 0.0), (36.0, 20.0, 9.0), ("floor", "south"))
    filled, _ = filled_of(row | post(), AROUND)
    assert not filled.conservative  # three sheets meet at the edges of the wall between them
    assert at(filled.field, 28.0, 0.2) == pytest.approx(9.0, abs=PIXEL)
    assert hidden(row | post(), AROUND)[0][0] == {"a east", "b east", "post"}


@pytest.mark.parametrize("end", [20.2, 22.0])
def test_a_cell_that_reaches_into_a_room_sees_what_is_in_it(end):
    sheets = house("house", (20.0, -20.0, 0.0), (36.0, 20.0, 9.0)) | post()
    sheets["lamp"] = box((0.5, 0.5, 1.0), (30.0, 0.0, 0.0))
    doorstep = np.array([[12.0, -4.0, 0.0], [end, 4.0, 2.0]])
    sets, found = hidden(sheets, [*AROUND, doorstep])
    assert "lamp" in sets[0]
    assert "post" in sets[0]
    assert not sets[4] & {"lamp", "house east", "house north", "house roof"}
    check = check_pvs(scene_of(sheets), found.pvs, CheckOptions(views=20, pictures=6, pixels=128))
    assert not check.leaks


def test_a_cell_amid_touched_voxels_sees_everything():
    # Sheets so close that no voxel between them is free, though one may look along them.
    gap = {f"sheet {x}": quad((x, -9, 0), (x, 9, 0), (x, 9, 9), (x, -9, 9)) for x in range(12, 29)}
    cell = np.array([[20.15, -1.0, 2.2], [20.25, 1.0, 2.3]])
    scene = scene_of(gap | house("house", (30.0, -9.0, 0.0), (40.0, 9.0, 9.0)) | post())
    found = find_pvs(
        upright_of(scene), cells_of([cell]), PvsOptions(up="z", epsilon=10.0, fill="viewers")
    )
    assert found.pvs.visible(0).all()


def slope(x, _y):
    return 0.1 * x


def terrain(x=(-10.0, 100.0), y=(-60.0, 60.0)):
    """A sheet that rises by 1 in 10 along x."""
    return quad(
        *(
            (a, b, slope(a, b) + 1.0)
            for a, b in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
        )
    )


def test_houses_on_terrain_are_closed_by_it():
    sheets = {"land": terrain()}
    # Walls reach into the land, as they do in models of cities.
    sheets |= house("house", (20.0, -20.0, 2.0), (36.0, 20.0, 15.0)) | post()
    sheets["post"] = box((2.0, 2.0, 9.0), (59.0, -1.0, 2.0))
    boxes = [
        np.array([[x, y, 1.0 + slope(x, y)], [x + 10.0, y + 10.0, 4.0 + slope(x, y)]])
        for x, y in ((-5.0, -5.0), (80.0, -5.0), (20.0, 40.0), (20.0, -50.0))
    ]
    filled, outside = filled_of(sheets, boxes, eye=1.7)
    assert at(outside, 28.0, 0.0) == -np.inf
    assert at(filled.field, 28.0, 0.0) == pytest.approx(15.0, abs=1e-4)
    assert at(filled.field, 70.25, 30.25) == pytest.approx(8.0, abs=0.1)  # the land itself
    assert not filled.conservative
    assert not filled.leaks
    sets, found = hidden(sheets, boxes, ground=True)
    assert "post" in sets[0]
    assert "land" not in sets[0]
    assert not any("from the ground" in warning for warning in found.warnings)


def test_houses_on_a_slope_without_land_stand_on_the_ground_if_told():
    sheets = house("low", (0.0, 20.0, 0.0), (10.0, 30.0, 9.0))
    sheets |= house("high", (20.0, -20.0, 3.0), (36.0, 20.0, 12.0))
    boxes = [one + np.array([0.0, 0.0, 1.5]) for one in AROUND]
    assert at(filled_of(sheets, boxes)[0].field, 28.0, 0.0) == -np.inf
    filled, _ = filled_of(sheets, boxes, eye=3.5)
    assert at(filled.field, 28.0, 0.0) == pytest.approx(12.0, abs=1e-4)


def test_what_stands_over_a_gap_is_lost_and_told():
    bridge = {"deck": box((10.0, 80.0, 6.0), (25.0, -40.0, 6.0))}
    bridge |= house("hall", (60.0, -5.0, 0.0), (70.0, 5.0, 9.0))
    filled, _ = filled_of(bridge, AROUND)
    assert at(filled.field, 30.0, 0.0) == -np.inf
    assert at(filled.field, 65.0, 0.0) == pytest.approx(9.0)
    assert filled.field.lost == pytest.approx(9600.0 / (9600.0 + 900.0), abs=0.05)
    _, found = hidden(bridge, AROUND)
    assert "is not solid from the ground up" in found.warnings[0]
    _, found = hidden({name: mesh for name, mesh in bridge.items() if name != "deck"}, AROUND)
    assert not any("from the ground up" in warning for warning in found.warnings)


def yard(width):
    """Four closed walls around a yard, with slits of a width at two of its corners."""
    walls = [
        [(20.0, -10.0, 0.0), (22.0, 10.0, 9.0)], [(34.0, -10.0, 0.0), (36.0, 10.0, 9.0)],
        [(22.0 + width, 8.0, 0.0), (34.0, 10.0, 9.0)], [(22.0 + width, -10, 0), (34.0, -8.0, 9.0)],
    ]  # fmt: skip
    return {name: box(np.subtract(b, a), a) for name, (a, b) in zip("abcd", walls, strict=True)}


def test_a_slit_that_no_voxel_fits_in_counts_where_the_mesh_is_closed():
    filled, _ = filled_of(yard(0.1) | post(), AROUND)
    assert at(filled.field, 28.0, 0.0) == -np.inf
    assert filled.conservative
    # One open sheet, and nothing is proven any more: then the yard is filled.
    torn = {"sheet": quad((50, 20, 0), (52, 20, 0), (52, 20, 3), (50, 20, 3))}
    filled, _ = filled_of(yard(0.1) | post() | torn, AROUND)
    assert at(filled.field, 28.0, 0.0) == pytest.approx(9.0)
    assert not filled.conservative
    filled, _ = filled_of(yard(4.0) | post() | torn, AROUND)
    assert at(filled.field, 28.0, 0.0) == -np.inf
    assert filled.conservative


@pytest.mark.parametrize("made", PUZZLES)
@pytest.mark.parametrize("epsilon", [1.25, 5.0])
def test_scenes_built_against_it_hide_nothing_that_is_seen(made, epsilon):
    one = made()
    options = PvsOptions(up="z", epsilon=epsilon, fill="viewers")
    found = find_pvs(upright_of(one.scene), one.cells, options)
    names = np.array(one.scene.names)
    assert one.seen <= set(names[found.pvs.visible(0)].tolist())
    assert found.pvs.conservative


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_closed_boxes_are_as_solid_as_they_are_by_themselves(seed):
    random = np.random.default_rng(seed)
    low = np.column_stack(
        [random.uniform(12.0, 60.0, (5, 1)), random.uniform(-30, 30, (5, 1)), np.zeros(5)]
    )
    high = low + random.uniform(2.0, 15.0, (5, 3))
    scene = scene_of_boxes(np.stack([low, high], axis=1), list("abcde"))
    upright, cells = upright_of(scene), cells_of(AROUND)
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    outside = height_field(upright, PIXEL, plan)
    nothing = replace(outside, inner=np.full_like(outside.inner, -np.inf))
    inner = fill_by_viewers(nothing, upright, cells, None).field.inner
    both = fill_by_viewers(outside, upright, cells, None).field.inner
    assert (both >= outside.inner).all()
    # Where boxes overlap, walls stand within: what is beside them is lost, a voxel to each side.
    apart = np.array([
        [(i == j) or (high[i] <= low[j]).any() or (high[j] <= low[i]).any() for j in range(5)]
        for i in range(5)
    ])  # fmt: skip
    if apart.all():
        covered = np.isfinite(outside.inner)
        assert (inner[covered] >= outside.inner[covered] - 1e-5).all()
        assert (inner[covered] <= outside.inner[covered] + 1e-5).all()


TILES = [(side, i, j) for side in range(4) for i in range(4) for j in range(2)]


def tiled(holes):
    """Two rooms whose walls are tiles of 4 x 4, less the holes, and one roof."""
    sheets = {"roof": quad((20, -8, 8), (36, -8, 8), (36, 8, 8), (20, 8, 8))}
    sheets["between"] = quad((20, 0, 0), (36, 0, 0), (36, 0, 8), (20, 0, 8))
    for side, i, j in set(TILES) - holes:
        a, b = 4.0 * i, 4.0 * i + 4.0
        z0, z1 = 4.0 * j, 4.0 * j + 4.0
        if side < 2:
            x = (20.0, 36.0)[side]
            corners = [(x, a - 8.0, z0), (x, b - 8.0, z0), (x, b - 8.0, z1), (x, a - 8.0, z1)]
        else:
            y = (-8.0, 8.0)[side - 2]
            corners = [(a + 20.0, y, z0), (b + 20.0, y, z0), (b + 20.0, y, z1), (a + 20.0, y, z1)]
        sheets[f"tile {side} {i} {j}"] = quad(*corners)
    return sheets | {"post": box((2.0, 2.0, 12.0), (59.0, -1.0, 0.0))}


@settings(max_examples=15, deadline=None)
@given(st.sets(st.sampled_from(TILES), max_size=6), st.sets(st.sampled_from(TILES), max_size=6))
def test_more_holes_never_give_more_solid(some, more):
    one, two = inner_of(tiled(some)), inner_of(tiled(some | more))
    assert (two.inner <= one.inner).all()
    rooms = [
        any((s < 2 and (i < 2) == low) or s == (2 if low else 3) for s, i, _ in some)
        for low in (True, False)
    ]
    for y, is_open in zip((-4.0, 4.0), rooms, strict=True):
        assert np.isinf(at(one, 28.0, y)) == is_open


def test_a_file_by_viewers_is_no_other_file():
    some = [PvsOptions(), PvsOptions(fill="viewers"), PvsOptions(fill="viewers", eye_height=2.0)]
    assert len({settings_digest(one) for one in some}) == 3


def test_cells_that_are_kept_are_as_sure_as_they_were():
    holed = house_with_hole() | house(
        "next", (20.0, 15.0, 0.0), (36.0, 35.0, 9.0), ("floor", "east")
    )
    scene = scene_of(holed | {"land": quad((-9, -60, 0), (99, -60, 0), (99, 60, 5), (-9, 60, 5))})
    options = PvsOptions(up="z", epsilon=2.5, fill="viewers")
    boxes = [one + np.array([0.0, 0.0, 6.0]) for one in AROUND]
    first = find_pvs(upright_of(scene), cells_of(boxes[:2]), options)
    again = find_pvs(upright_of(scene), cells_of(boxes), options, first.pvs)
    assert again.made == 2
    assert again.pvs.conservative <= first.pvs.conservative
