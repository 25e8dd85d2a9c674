"""Sets that lack something are found out, and how much too large others are."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.errors import CancelledError, OptionError, SceneError
from simplifier.geometry.pvs import NEVER, UNKNOWN, Altitudes, Pvs, pack_rows
from simplifier.geometry.scene import Scene, axis_order
from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.checking.check import CheckOptions, check_pvs, viewpoints
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from tests.hierarchy.scenes import moved, scene_of
from tests.solids import box
from tests.visibility.scenes import PUZZLES, street_cell, two_penumbrae

FEW = CheckOptions(cells=4, views=25, azimuths=90)


def pvs_of(scene, cells, sets, up="z", origin=(0.0, 0.0, 0.0)):
    rows, places = pack_rows(sets)
    order = np.arange(len(scene), dtype=np.int32)
    return Pvs(
        up, np.array(origin), scene.names, order, cells, rows, places, "cull-map", True, bytes(8),
        bytes(8),
    )  # fmt: skip


def everything(scene, cells):
    return [np.ones(len(scene), dtype=bool) for _ in range(len(cells))]


@pytest.fixture(scope="module")
def city():
    """A small city, street cells, and what is seen from many points of each."""
    scene = generated_city(6, seed=2)
    cells = street_cells(scene, 4, seed=3)
    prisms = prisms_of(scene, "z")
    generator = np.random.default_rng(9)
    sets = []
    for cell in range(len(cells)):
        eyes = viewpoints(cells, cell, 400, generator) - prisms.origin
        sets.append(~np.isnan(seen_from(prisms, eyes, 400)).all(axis=0))
    return scene, cells, sets


def test_of_everything_nothing_leaks_and_it_is_too_large(city):
    scene, cells, _ = city
    check = check_pvs(scene, pvs_of(scene, cells, everything(scene, cells)), FEW)
    assert check.leaks == ()
    assert [row.visible for row in check.rows] == [len(scene)] * 4
    assert check.excess > 1.5
    assert check.culled_share == 0.0
    assert check.proven_share == pytest.approx(1.0 / check.excess)
    assert check.row_bytes == check.rows[0].bytes / 4


def test_a_set_of_what_is_seen_has_no_leak_and_hardly_too_much(city):
    scene, cells, sets = city
    check = check_pvs(scene, pvs_of(scene, cells, sets), FEW)
    assert check.leaks == ()
    assert 1.0 <= check.excess < 1.1
    assert check.proven_share == pytest.approx(1.0 / check.excess)
    assert check.culled_share > 0.3
    assert [row.cell for row in check.rows] == [0, 1, 2, 3]
    assert all(row.seen == row.proven <= row.visible for row in check.rows)


def test_one_object_that_is_missing_is_named_with_a_line_that_shows_it(city):
    scene, cells, sets = city
    eyes = viewpoints(cells, 2, 30, np.random.default_rng(0)) - prisms_of(scene, "z").origin
    often = (~np.isnan(seen_from(prisms_of(scene, "z"), eyes, 90))).mean(axis=0)
    missing = int(np.flatnonzero(often > 0.3)[0])
    sets = [each.copy() for each in sets]
    sets[2][missing] = False
    (leak,) = check_pvs(scene, pvs_of(scene, cells, sets), FEW).leaks
    assert (leak.cell, leak.name, leak.proof) == (2, scene.names[missing], "line")
    assert (cells.low[2] <= leak.viewpoint).all()
    assert (leak.viewpoint <= cells.high[2]).all()
    assert _meets(scene, missing, leak)


def test_an_altitude_that_is_too_high_is_found_from_below_it():
    """From x = 0 at 7 / 3 a line over the wall's top, at x = 5, meets the tower's, at x = 20."""
    boxes = np.array([
        [[5.0, -900, 0], [6, 900, 3]], [[20, -1, 0], [21, 1, 5]], [[-9, -9, 0], [-8, 9, 9]],
    ])  # fmt: skip
    scene = scene_of_boxes(boxes, ["wall", "tower", "behind"])
    cells = ViewCells.boxes(np.array([[0.0, 0, 0]]), np.array([[1.0, 1, 4]]))
    sets = pvs_of(scene, cells, everything(scene, cells))
    leaks = {}
    for altitude in (0, 233, 300, NEVER):
        values = np.array([[0, altitude, 0]], np.uint16)
        low, step = 0.0, float(np.float32(0.01))
        pvs = replace(sets, altitudes=Altitudes(low, step, values))
        leaks[altitude] = check_pvs(scene, pvs, replace(FEW, views=200)).leaks
    assert (leaks[0], leaks[233]) == ((), ())
    for altitude, top in ((300, 3.0), (NEVER, 4.0)):
        (leak,) = leaks[altitude]
        assert (leak.name, leak.proof) == ("tower", "line")
        assert 7 / 3 < leak.viewpoint[2] <= top


def _meets(scene, index, leak):
    """Whether the plan of a box lies along the direction of a leak."""
    low, high = scene.bounds()[index][:, :2]
    origin, ahead = np.array(leak.viewpoint)[:2], np.array(leak.direction)[:2]
    ends = np.stack([low - origin, high - origin]) / np.where(ahead == 0.0, 1e-300, ahead)
    return ends.min(axis=0).max() <= ends.max(axis=0).min()


@pytest.mark.parametrize("make", PUZZLES)
def test_what_a_puzzle_shows_is_found_within_a_thousand_viewpoints(make):
    posed = make()
    nothing = [np.zeros(len(posed.scene), dtype=bool)]
    check = check_pvs(
        posed.scene, pvs_of(posed.scene, posed.cells, nothing), CheckOptions(views=1000)
    )
    names = {leak.name for leak in check.leaks}
    assert posed.seen <= names
    assert not posed.hidden & names
    assert check.rows[0].proven == 0
    assert check.excess == 0.0


def pictures_alone(**options):
    """As good as no lines: they see but one thing each."""
    return CheckOptions(views=6, azimuths=0, margin=1e9, pictures=6, pixels=96, **options)


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_pictures_show_the_same_whichever_axis_is_up(up):
    posed = two_penumbrae()
    order = axis_order(up)
    turn = np.eye(4)
    turn[:3, :3] = np.eye(3)[:, np.argsort(order)].T
    scene = replace(posed.scene, transforms=turn @ posed.scene.transforms)
    assert np.array_equal(scene.bounds()[:, :, order], posed.scene.bounds())
    origin = np.array([3.0, -2.0, 0.0])
    cells = ViewCells.boxes(posed.cells.low - origin, posed.cells.high - origin)
    pvs = pvs_of(scene, cells, [np.zeros(3, dtype=bool)], up, origin)
    check = check_pvs(scene, pvs, pictures_alone())
    assert {leak.name for leak in check.leaks} == {"right", "left"}
    for leak in check.leaks:
        place, ahead = np.array(leak.viewpoint)[order], np.array(leak.direction)[order]
        upright = replace(leak, viewpoint=tuple(place), direction=tuple(ahead))
        assert _meets(posed.scene, posed.scene.names.index(leak.name), upright)
        assert (np.abs(place[:2]) <= 5.0).all()


def test_a_picture_sees_through_an_arch_which_no_column_lets_it():
    arch = box((2.0, 100.0, 20.0), (20.0, -50.0, 8.0))
    scene = scene_of([arch, box((5.0, 5.0, 6.0), (40.0, 0.0, 0.0))], [0, 1], [moved(), moved()])
    pvs = pvs_of(scene, street_cell(), [np.array([True, False])])
    assert check_pvs(scene, pvs, FEW).leaks == ()
    check = check_pvs(scene, pvs, replace(FEW, pictures=2, pixels=128))
    assert [(leak.name, leak.proof) for leak in check.leaks] == [("object 1", "picture")]
    assert check.rows[0].seen == 2


def test_with_ground_nobody_looks_below_houses_uphill():
    boxes = np.array(
        [
            [[20.0, -90.0, 0.0], [24.0, 90.0, 1.0]],
            [[30, -90, 8], [40, 90, 20]],
            [[60, -3, 1], [70, 3, 9]],
        ]
    )
    scene = scene_of_boxes(boxes, ["curb", "uphill", "behind"])
    pvs = pvs_of(scene, street_cell(), [np.array([True, True, False])])
    options = replace(FEW, pictures=3, pixels=128)
    assert [leak.name for leak in check_pvs(scene, pvs, options).leaks] == ["behind"]
    assert check_pvs(scene, pvs, replace(options, ground=True)).leaks == ()


def test_a_viewpoint_at_a_wall_does_not_look_through_it():
    boxes = np.array([[[5.0, -50.0, 0.0], [8.0, 50.0, 9.0]], [[8.0, -3.0, 0.0], [20.0, 3.0, 8.0]]])
    scene = scene_of_boxes(boxes, ["touches the cell", "behind"])
    pvs = pvs_of(scene, street_cell(), [np.array([True, False])])
    assert check_pvs(scene, pvs, replace(FEW, pictures=8, pixels=64)).leaks == ()


def test_viewpoints_are_of_the_cell_and_most_on_its_upper_edges():
    triangle = np.array([[[0.0, 0.0], [9.0, 0.0], [0.0, 6.0]]])
    cells = ViewCells.joined(
        street_cell(), ViewCells.prisms(triangle, np.zeros(1), np.full(1, 3.0))
    )
    for cell in range(2):
        places = viewpoints(cells, cell, 200, np.random.default_rng(1))
        corners = cells.outline(cell)
        assert np.array_equal(places[: len(corners), :2], corners)
        assert (places[:150, 2] == cells.high[cell, 2]).all()
        assert len(np.unique(places[150:, 2])) == 50
        inner = places.copy()
        inner[:, :2] += 1e-9 * (corners.mean(axis=0) - inner[:, :2])
        assert all(cell in cells.containing(place) for place in inner)
        assert len(viewpoints(cells, cell, 2, np.random.default_rng(1))) == 2


def test_the_same_for_a_seed_and_cells_that_are_not_computed_are_left_alone(city):
    scene, cells, sets = city
    pvs = pvs_of(scene, cells, [~each for each in sets])
    pvs = replace(pvs, row_of=np.array([0, UNKNOWN, 2, 3]))
    shares: list[float] = []
    check = check_pvs(scene, pvs, FEW, shares.append)
    assert check == check_pvs(scene, pvs, FEW)
    assert [row.cell for row in check.rows] == [0, 2, 3]
    assert shares == [0.0, 1 / 3, 2 / 3, 1.0]
    two = [check_pvs(scene, pvs, replace(FEW, cells=2, seed=seed)).rows for seed in range(6)]
    assert {len(rows) for rows in two} == {2}
    assert len({rows[0].cell + 4 * rows[1].cell for rows in two}) > 1
    with pytest.raises(OptionError, match="no cell"):
        check_pvs(scene, replace(pvs, row_of=np.full(4, UNKNOWN)), FEW)


def test_a_cancel_leaves_what_was_checked_by_then(city):
    scene, cells, sets = city
    pvs, cancel = pvs_of(scene, cells, sets), threading.Event()

    def tell(share):
        if share >= 0.25:
            cancel.set()

    assert len(check_pvs(scene, pvs, FEW, tell, cancel).rows) == 2
    with pytest.raises(CancelledError):
        check_pvs(scene, pvs, FEW, cancel=cancel)


def test_sets_of_another_scene_and_options_out_of_range_are_refused(city):
    scene, cells, sets = city
    other = Scene(
        scene.meshes, tuple(f"{n}!" for n in scene.names), scene.mesh_of, scene.transforms
    )
    with pytest.raises(SceneError, match="not those of the scene"):
        check_pvs(other, pvs_of(scene, cells, sets), FEW)
    for wrong in ({"cells": 0}, {"views": 0}, {"pixels": 1}, {"margin": -1.0}, {"pictures": -1}):
        with pytest.raises(OptionError):
            CheckOptions(**wrong)
