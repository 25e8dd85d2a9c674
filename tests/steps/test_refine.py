"""Refinement as a whole: inside the solid, within the budget, never worse than a start."""

from __future__ import annotations

import math
import time
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import simplifier
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import deviation
from simplifier.accuracy.front import measure_front
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.room import EVERYWHERE, SURFACE
from simplifier.geometry.views import random_directions
from simplifier.kernels.soup_views import all_contained
from simplifier.options.stages import ERROR_VOXELS, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Deadline
from simplifier.refinement import search
from simplifier.refinement.containment import are_inside, narrowest_room
from simplifier.refinement.search import hidden_share, pull_into
from simplifier.refinement.second_search import search_again
from simplifier.refinement.starts import Surfaces
from simplifier.refinement.trim import trimmed
from simplifier.steps import look as look_step
from simplifier.steps import refine as refine_step
from simplifier.steps import room as room_step
from simplifier.steps.refine import Refined
from simplifier.steps.room import open_room
from tests.solids import (
    blob,
    box,
    flower,
    hills,
    joined,
    ladder,
    pipe,
    rounded_box,
    sphere,
    torus,
    town,
    triangles_of,
    truss,
    turned,
    waves,
)


def run(mesh, listener=None, **options):
    return simplify_mesh(mesh, make_options(float(mesh.extent.max()), **options), listener)


def keep_rooms_narrow(monkeypatch):
    """Have sheets searched within a cell's diagonal, as solids are."""
    monkeypatch.setattr(room_step, "_share_past_diagonal", lambda *any_: 0.0)


def leave_slabs_out(monkeypatch):
    """Have thin meshes searched as thick ones are."""
    monkeypatch.setattr(room_step, "thin_slab", lambda *any_: EVERYWHERE)


def check_contained(mesh, result, triangles=None):
    """No triangle touches a voxel that it may not: of the occluder, or others (n, 3, 3)."""
    room = open_room(mesh, result.solid, make_options(float(mesh.extent.max())))
    occluder = result.occluder
    if triangles is None:
        triangles = occluder.vertices[occluder.faces]
    soup = result.solid.core.to_grid(triangles) + room.margin
    inside = np.zeros(len(soup), dtype=np.bool_)
    # World coordinates and back cost a rounding: give it room.
    middle = soup.mean(axis=1, keepdims=True)
    all_contained(middle + (soup - middle) * (1.0 - 1e-9), room.voxels, inside)
    assert inside.all()


def check_triangles(occluder, budget):
    """Within the budget, with area, none twice."""
    assert len(occluder.faces) <= budget
    edges = occluder.vertices[occluder.faces]
    area = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    assert (area != 0.0).any(axis=1).all()
    assert len(np.unique(np.sort(occluder.faces, axis=1), axis=0)) == len(occluder.faces)


@pytest.mark.parametrize("mesh", [sphere(), torus(), blob(1)], ids=["sphere", "torus", "blob"])
def test_more_of_the_room_is_taken_where_nothing_sticks_out(monkeypatch, mesh):
    """Few triangles stand before few of a city's houses, so they stick out by far less than all of
    its outline would: in the room for that, all of it hid nothing."""
    options = {"budget": 32, "resolution": 24, "overhang": 0.2, "preset": "draft"}
    monkeypatch.setattr(look_step, "narrowed_room", lambda room, *others: room.up_to(SURFACE))
    never_glance(monkeypatch)

    def made():
        """A result, its recall, and the layers of the room that it keeps to."""
        result = run(mesh, **options)
        edge = float(mesh.extent.max())
        room = open_room(mesh, result.solid, make_options(edge, **options))
        soup = result.solid.core.to_grid(result.occluder.vertices[result.occluder.faces])
        middle = soup.mean(axis=1, keepdims=True)
        soup = middle + (soup - middle) * (1.0 - 1e-9) + room.margin  # from the world and back
        kept = narrowest_room(soup, room.up_to(SURFACE), room.limit)
        assert are_inside(soup, kept).all()
        assert result.occluder.error_bound == kept.bound * result.solid.core.cell_size
        judged = evaluate_accuracy(mesh, result.occluder, AccuracyOptions(64, exact=True))
        return judged.recall, kept.limit

    recall, layers = made()
    monkeypatch.setattr(search, "_NEXT_TO_NOTHING", 0.0)
    before, least = made()
    assert layers > least == SURFACE
    assert recall > before + 0.05


@pytest.mark.sweep(3)
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("conservative", [False, True])
@pytest.mark.parametrize(
    "mesh",
    [box(), torus(), joined(sphere(), box(low=(1.5, 0.0, 0.0)))],
    ids=["box", "torus", "two"],
)
def test_every_triangle_keeps_to_its_voxels(mesh, conservative, seed):
    result = run(mesh, budget=24, resolution=24, moves=3000, conservative=conservative, seed=seed)
    assert len(result.occluder.faces) > 0
    check_contained(mesh, result)
    check_triangles(result.occluder, 24)


@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.integers(1, 40))
def test_any_soup_within_any_budget(seed, count, budget):
    corners = np.random.default_rng(seed).normal(size=(3 * count, 3))
    mesh = TriangleMesh.from_soup(corners, np.arange(3 * count).reshape(-1, 3))
    result = run(mesh, budget=budget, resolution=16, moves=600)
    check_contained(mesh, result)
    check_triangles(result.occluder, budget)


class Bests:
    """A listener who takes what there is at each tell."""

    def __init__(self):
        self.taken, self.stages = [], set()

    def __call__(self, progress):
        if progress.best is None:
            assert progress.measure is None
            return
        self.stages.add(progress.stage)
        self.taken.append((progress.measure, progress.best()))


@pytest.mark.sweep(3)
@pytest.mark.parametrize("preset", ["draft", "balanced"])
@pytest.mark.parametrize("conservative", [False, True])
def test_the_best_so_far_keeps_to_its_voxels_and_comes_to_the_result(preset, conservative):
    mesh, bests = joined(sphere(), box(low=(1.5, 0.0, 0.0))), Bests()
    options = {"budget": 24, "resolution": 24, "preset": preset, "conservative": conservative}
    result = run(mesh, bests, moves=9000, **options)
    assert bests.stages == {"refine"}
    assert len(bests.taken) > 3
    for _, triangles in bests.taken:
        assert triangles.shape[1:] == (3, 3)
        assert len(triangles) <= 24
        check_contained(mesh, result, triangles)

    def recall(triangles):
        occluder = Occluder.of(triangles, 0.0, {})
        return simplifier.evaluate(mesh, occluder, exact=True, views=64, image=128).accuracy.recall

    last = recall(bests.taken[-1][1])
    assert last == pytest.approx(recall(result.occluder.vertices[result.occluder.faces]), abs=0.02)
    assert last > recall(bests.taken[0][1])


def test_who_takes_the_best_changes_nothing():
    options = {"budget": 12, "resolution": 16, "moves": 3000}

    def spoil(progress):
        if progress.best is not None:
            progress.best()[:] = 0.0

    heard, alone = run(torus(), spoil, **options).occluder, run(torus(), **options).occluder
    assert heard.vertices.tobytes() == alone.vertices.tobytes()
    assert heard.faces.tobytes() == alone.faces.tobytes()


def test_a_mesh_within_the_budget_hides_what_it_hides():
    # Walls without an inside: sections see rings, the mesh itself is the best occluder.
    walls = joined(*(box((0.001, 1.0, 1.0), low=(0.25 * i, 0.0, 0.0)) for i in range(4)))
    for seed in (0, 1):
        occluder = simplifier.simplify(
            walls, budget=64, resolution=32, moves=600, seed=seed
        ).occluder
        report = simplifier.evaluate(walls, occluder, exact=True, views=64, image=128).accuracy
        assert report.recall > 0.95
        assert report.precision > 0.99


@pytest.mark.parametrize(("mesh", "divided"), [(hills(24), True), (sphere(), False)])
def test_within_a_time_limit_other_searches_are_for_sheets_alone(monkeypatch, mesh, divided):
    """All of a limit could be spent on triangles that only stick out: a terrain had 92 % by 1 and
    2 seconds, and 98 by half of one."""
    ends = []

    def search(*given):
        ends.append(given[-1])

    monkeypatch.setattr("simplifier.steps.refine.search_again", search)
    begin = time.perf_counter()
    run(mesh, budget=24, resolution=32, time_limit=1.5)
    assert time.perf_counter() - begin < 2.5
    assert [one.limited for one in ends] == [True] * divided


def test_starts_of_sections_alone_are_worse_for_a_sheet(monkeypatch):
    sheet = hills(24)

    def recall():
        occluder = simplifier.simplify(
            sheet, budget=32, resolution=32, ground=True, preset="draft", moves=1200
        ).occluder
        return simplifier.evaluate(sheet, occluder, exact=True, views=64, image=128).accuracy.recall

    by_its_surface = recall()
    monkeypatch.setattr(refine_step, "_LITTLE", 0.0)  # no sections are so poor
    monkeypatch.setattr(Surfaces, "terrain_like", False)
    assert by_its_surface > recall() + 0.05


def test_a_draft_of_bars_begins_with_the_mesh_too(monkeypatch):
    """Sections of them had 4 to 10 % of what they hide, and other starts were for sheets alone."""
    bars = ladder()
    never_glance(monkeypatch)

    def recall():
        occluder = run(bars, budget=32, preset="draft").occluder
        return evaluate_accuracy(bars, occluder, AccuracyOptions(64, 128, exact=True)).recall

    assert recall() > 0.9
    monkeypatch.setattr(refine_step, "_LITTLE", 0.0)  # no sections are so poor
    leave_slabs_out(monkeypatch)
    assert recall() < 0.2


@pytest.mark.parametrize(
    ("options", "last"),
    [
        (
            {"preset": "draft"},
            "The occluder was found by searches that began with planar sections and the mesh in"
            " fewer triangles, with all that is finer than a voxel.",
        ),
        ({"moves": 0}, "The occluder is made of planar sections, which were not refined."),
        (
            {"budget": 1000},
            "The mesh has no more triangles than the budget, so it is its own occluder.",
        ),
    ],
)
def test_where_the_triangles_come_from_is_said(options, last):
    chosen = make_options(2.0, **{"budget": 12, "resolution": 24, **options})
    assert simplify_mesh(blob(rings=8), chosen).decisions[-1] == last


def nothing_is_cut(monkeypatch):
    """As it would be where a patched judge prefers what is worth little."""
    monkeypatch.setattr("simplifier.steps.refine.trimmed", lambda *given: [])


def test_several_starts_are_named_and_one_that_stays_as_it_is(monkeypatch):
    nothing_is_cut(monkeypatch)
    mesh, chosen = blob(rings=8), make_options(2.0, budget=12, resolution=24, moves=300)
    of_solid = "the surface of the solid in fewer triangles"
    of_starts = f"planar sections, {of_solid} and the mesh in fewer triangles"
    for chooses, words in (
        (0, f"The occluder was found by searches that began with {of_starts}."),
        (-2, f"No search did better than {of_solid}, which became the occluder."),
        (-3, "No search did better than planar sections, which became the occluder."),
    ):
        monkeypatch.setattr(
            "simplifier.steps.refine.Judge.best_of",
            lambda judge, soups, *spare, at=chooses: soups[at],
        )
        assert simplify_mesh(mesh, chosen).decisions[-1] == words
    for chosen_soup, words in (
        (
            np.empty((0, 3, 3)),
            "All that was found would hide too much wrongly, so the occluder is empty.",
        ),
        (
            np.ones((1, 3, 3)),
            "No search did better than the mesh in fewer triangles, with all that is finer than a"
            " voxel, which became the occluder.",
        ),
    ):
        monkeypatch.setattr(
            "simplifier.steps.refine.Judge.best_of", lambda *judging, it=chosen_soup: it
        )
        assert simplify_mesh(mesh, chosen).decisions[-1] == words


def test_sections_that_hide_much_leave_no_other_starts(monkeypatch):
    def named():
        made = run(sphere(), budget=24, resolution=24, moves=600)
        return made.decisions[-1].count("in fewer triangles")

    assert named() == 0
    for much, others in ((0.0, 0), (1.0, 2)):
        monkeypatch.setattr(refine_step, "MUCH_BEGUN", much)
        assert named() == others


def test_where_fewer_triangles_hide_nearly_all_nothing_is_searched(monkeypatch):
    """A search left 98 % of a rounded box, in ten times the time."""

    def refine(*given):
        raise AssertionError

    monkeypatch.setattr("simplifier.steps.refine.refine", refine)
    mesh = rounded_box()
    made = run(mesh, budget=64)
    assert made.decisions[-1].endswith("hides nearly all of it, so nothing was searched.")
    report = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))
    assert report.recall >= 0.99
    assert report.precision >= 0.9999
    check_contained(mesh, made)
    check_triangles(made.occluder, 64)


@pytest.mark.parametrize("how", [{}, {"preset": "draft"}, {"time_limit": 60.0}], ids=str)
def test_of_a_sheet_with_an_outline_nothing_is_searched_where_it_hides_nearly_all(monkeypatch, how):
    """A search left 98.7 % of it, in ten times the time."""

    def refine(*given):
        raise AssertionError

    monkeypatch.setattr("simplifier.steps.refine.refine", refine)
    mesh = hills(120)
    made = run(mesh, budget=128, up="z", **how)
    assert made.decisions[-1].endswith("hides nearly all of it, so nothing was searched.")
    report = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))
    assert report.recall >= 0.996
    check_triangles(made.occluder, 128)


@pytest.mark.parametrize("how", [{}, {"time_limit": 60.0}], ids=str)
def test_a_draft_of_a_curved_sheet_is_judged_in_full_detail_however_good_its_sections_are(
    monkeypatch, how
):
    """Half a pipe in 64 triangles hid 92.8 % by its sections and a search, in twice the time."""
    u, v, _ = hills(150).vertices.T
    bent = np.stack([np.cos(np.pi * u), np.sin(np.pi * u), 3.0 * v], axis=1)
    mesh, scores = TriangleMesh.from_soup(bent, hills(150).faces), []

    def share(*given):
        scores.append(hidden_share(*given))
        return scores[-1]

    with monkeypatch.context() as patch:
        patch.setattr(Surfaces, "terrain_like", False)
        patch.setattr(refine_step, "hidden_share", share)
        run(mesh, budget=64, up="z", preset="draft")
    assert min(scores) > refine_step._LITTLE
    made = run(mesh, budget=64, up="z", preset="draft", **how)
    assert made.decisions[-1].endswith("hides nearly all of it, so nothing was searched.")
    report = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))
    assert report.recall >= 0.995
    check_triangles(made.occluder, 64)


def never_glance(monkeypatch):
    monkeypatch.setattr(look_step, "_is_told_soon", lambda mesh, budget: False)


def drafts(monkeypatch, mesh, budget):
    """Without a glance at the mesh in full detail and with it: reports, and how it was found."""
    made = []
    for glances in (False, True):
        with monkeypatch.context() as patch:
            if not glances:
                never_glance(patch)
            result = run(mesh, budget=budget, preset="draft")
        check_triangles(result.occluder, budget)
        check_contained(mesh, result)
        report = simplifier.evaluate(mesh, result.occluder, views=64, image=128)
        made.append((report, result.decisions[-1]))
    return made


def test_a_draft_keeps_a_mesh_in_full_detail_where_that_hides_nearly_all(monkeypatch):
    """A rounded box hid 94.0 %, with 2.1 % beside it in one view, in twice the time."""
    (before, _), (after, how) = drafts(monkeypatch, rounded_box(), 64)
    assert how.endswith("hides nearly all of it, so nothing was searched.")
    assert after.recall > max(0.99, before.recall)
    assert after.overhang.by_view.max() < 0.002 < before.overhang.by_view.max()


def test_a_draft_that_may_stick_out_more_is_searched_for():
    """By 5 % of overhang a search finds more than what is flush hides."""
    rock, recalls = blob(rings=40), []
    for overhang in (0.005, 0.05):
        made = run(rock, budget=256, preset="draft", overhang=overhang)
        assert made.decisions[-1].endswith("so nothing was searched.") == (overhang < 0.01)
        recalls.append(simplifier.evaluate(rock, made.occluder, views=64).recall)
    assert recalls[0] < recalls[1]


def test_a_draft_takes_a_mesh_in_full_detail_that_hides_more_than_what_it_found(monkeypatch):
    """A ball in 96 triangles hid 91.1 %, with 0.70 % beside it."""
    (before, _), (after, how) = drafts(monkeypatch, sphere(), 96)
    assert how.startswith("No search did better than the mesh in fewer triangles")
    assert after.recall > before.recall + 0.01
    assert after.overhang.mean < before.overhang.mean


@pytest.mark.parametrize(("mesh", "budget"), [(torus(), 32), (sphere(), 64)])
def test_a_draft_keeps_what_it_found_where_that_hides_more(monkeypatch, mesh, budget):
    """The mesh scores less than 0.6 of what sections do, so no search begins with it either."""
    (before, _), (after, how) = drafts(monkeypatch, mesh, budget)
    assert how == "The occluder was found by searches that began with planar sections."
    assert after.recall == before.recall


def test_a_draft_begins_with_the_mesh_that_it_has_glanced_at(monkeypatch):
    """A pipe in 16 triangles hid 56 %: sections of it are as thin as its wall."""
    mesh = pipe(wall=0.1)
    (before, _), (after, how) = drafts(monkeypatch, mesh, 16)
    assert how.startswith("The occluder was found by searches that began with planar sections and")
    assert before.recall < 0.6 < 0.8 < after.recall
    monkeypatch.setattr(refine_step, "_BESIDE", np.inf)
    _, (without, how) = drafts(monkeypatch, mesh, 16)
    assert how == "The occluder was found by searches that began with planar sections."
    assert without.recall == before.recall


def test_a_draft_takes_no_mesh_that_stands_further_before_the_surface(monkeypatch):
    """Asked for 2 % of front, it took a mesh in full detail that has 6.5, and hides more."""
    mesh, chosen = blob(), {"budget": 32, "resolution": 26, "overhang": 0.05, "front": 0.02}

    def front():
        made = run(mesh, preset="draft", moves=300, **chosen)
        return measure_front(mesh, made.occluder, random_directions(64, 0)).mean

    assert front() < 0.035
    monkeypatch.setattr(refine_step, "_stands_further_before", lambda *given: False)
    assert front() > 0.05


@pytest.mark.parametrize(
    ("mesh", "budget", "soon"),
    [
        (rounded_box(), 64, True),  # flat for the most part
        (sphere(rings=31), 8, True),  # round, and of few
        (sphere(rings=40), 64, False),
        (sphere(rings=40), 192, True),
    ],
)
def test_what_is_flat_or_of_few_triangles_is_glanced_at(mesh, budget, soon):
    assert look_step._is_told_soon(mesh, budget) is soon


@pytest.mark.parametrize(
    "options",
    [{"preset": "balanced"}, {"time_limit": 2.0}, {"overhang": 1.0}, {"conservative": True}],
    ids=str,
)
def test_only_drafts_that_keep_to_an_overhang_glance(monkeypatch, options):
    """Others judge the mesh in full detail in any case, or have no pictures to judge it by."""
    asked = []
    monkeypatch.setattr(look_step, "_is_told_soon", lambda *given: asked.append(given))
    run(rounded_box(), **{"preset": "draft", "budget": 64, "resolution": 32, **options})
    assert asked == []


@pytest.mark.parametrize(
    ("preset", "within"),
    [("balanced", {}), ("draft", {}), ("balanced", {"time_limit": 60.0})],
    ids=str,
)
def test_hills_in_few_triangles_are_settled(monkeypatch, preset, within):
    """A search hid 80.2 % of these; a draft kept them decimated, with 5.7 % beside in one view."""
    keep_rooms_narrow(monkeypatch)
    mesh = hills(120)
    made = run(mesh, budget=56, up="z", preset=preset, **within)
    with monkeypatch.context() as patch:
        patch.setattr(refine_step, "settled", lambda triangles, *others: triangles)
        # Never within a limit: what a search then finds differs from run to run.
        without = run(mesh, budget=56, up="z", preset=preset)
    assert made.decisions[-1].endswith("hides nearly all of it, so nothing was searched.")
    assert not without.decisions[-1].endswith("so nothing was searched.")
    report, other = (simplifier.evaluate(mesh, one.occluder, up="z") for one in (made, without))
    assert report.recall >= max(0.97, other.recall - 0.01)
    assert report.overhang.by_view.max() < other.overhang.by_view.max()
    check_contained(mesh, made)
    check_triangles(made.occluder, 56)


@pytest.mark.parametrize(("preset", "least"), [("draft", 0.9), ("balanced", 0.95)])
def test_hills_in_too_few_triangles_for_their_room_are_fitted_into_it(preset, least):
    """A draft hid 24 % of these and a search 65, since what left the room left holes."""
    mesh = hills(120)
    made = run(mesh, budget=48, up="z", preset=preset)
    report = simplifier.evaluate(mesh, made.occluder, up="z")
    assert report.recall >= least
    assert report.overhang.mean <= 0.006
    check_contained(mesh, made)
    check_triangles(made.occluder, 48)


@pytest.mark.parametrize(
    ("how", "enough", "searched"),
    [
        ({}, "_SETTLED", True),
        ({}, "_SETTLED_WELL", False),
        ({"preset": "best"}, "_SETTLED_WELL", True),
        ({"preset": "best"}, "_SETTLED", False),
        ({"time_limit": 1.0}, "FLAWLESS", True),
        ({"time_limit": 30.0}, "_SETTLED", False),
    ],
)
def test_more_has_to_be_settled_where_a_search_finds_more(monkeypatch, how, enough, searched):
    """Within three seconds a dome in 200 triangles hid 96.6 %, where a search finds 98.6."""
    keep_rooms_narrow(monkeypatch)
    monkeypatch.setattr(refine_step, enough, 2.0)
    made = run(hills(120), budget=56, up="z", **how)
    assert made.decisions[-1].endswith("so nothing was searched.") != searched


@pytest.mark.parametrize(
    ("how", "searched"),
    [
        ({}, False),
        ({"moves": 100_000}, True),
        ({"time_limit": 1.0}, True),
        ({"overhang": 0.02}, True),
    ],
    ids=str,
)
def test_what_hides_nearly_all_is_searched_for_by_who_asks_for_more(how, searched):
    """A ball in 200 triangles took 0.9 s in place of 0.1, for as much."""
    made = run(sphere(), budget=200, resolution=48, **how)
    assert made.decisions[-1].endswith("so nothing was searched.") != searched
    assert simplifier.evaluate(sphere(), made.occluder, views=64, image=128).recall > 0.96


def test_who_lets_more_stick_out_gets_what_a_search_finds_by_it():
    """A terrain hid 98.8 in place of 99.7 % where 5 % was allowed and 0.3 used."""
    mesh, recall = hills(120), []
    for overhang in (0.005, 0.05):
        made = run(mesh, budget=56, up="z", overhang=overhang)
        assert made.decisions[-1].endswith("so nothing was searched.") == (overhang < 0.01)
        recall.append(simplifier.evaluate(mesh, made.occluder, up="z").recall)
    assert recall[0] < recall[1]


def test_a_sheet_that_hides_little_is_not_settled(monkeypatch):
    """Of what has holes no corner closes one."""
    asked = []
    monkeypatch.setattr(refine_step, "settled", lambda *given: asked.append(given))
    run(hills(120), budget=12, up="z", preset="draft")
    assert asked == []


def test_what_full_detail_hides_is_kept_where_no_time_is_left_to_search(monkeypatch):
    """A terrain in 256 triangles hid 93.6 % within a quarter of a second, and 99.7 as a draft, in
    less."""
    monkeypatch.setattr(refine_step, "_JUDGED_SECONDS", math.inf)
    mesh = hills(120)
    made = run(mesh, budget=64, up="z", time_limit=3.0)
    assert made.decisions[-1].endswith("was kept, since no time was left to search.")
    report = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))
    assert report.recall >= 0.97
    check_triangles(made.occluder, 64)


def stretched(rings):
    ball = sphere(rings=rings)
    return TriangleMesh.from_soup(ball.vertices * [1.0, 0.3, 0.6], ball.faces)


@pytest.mark.parametrize(
    ("mesh", "least"),
    [(stretched(40), 0.9), (stretched(80), 0.88), (sphere(rings=80), 0.84)],
    ids=["of few triangles", "smooth", "where a start is better than what was found"],
)
def test_of_what_is_round_the_mesh_in_full_detail_is_judged_too(mesh, least):
    made = run(mesh, budget=64)
    words = "the mesh in fewer triangles, with all that is finer than a voxel"
    assert made.decisions[-1] == f"No search did better than {words}, which became the occluder."
    report = evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))
    assert report.recall >= least


def test_a_second_search_is_told_and_never_runs_backwards(monkeypatch):
    monkeypatch.setattr("simplifier.refinement.second_search._FAULTS", -1.0)
    mesh, shares, done = joined(sphere(), box((2.5, 0.2, 2.5), low=(0.0, -0.1, 0.0))), [], []

    def listen(progress):
        if progress.stage == "refine":
            shares.append(progress.share)

    def search(*given):
        done.append(shares[-1])
        found = search_again(*given)
        done.append(shares[-1])
        less = given[2].up_to(given[2].limit - 1)
        return found or (pull_into(given[0][0], less), less)

    monkeypatch.setattr("simplifier.steps.refine.search_again", search)
    result = run(mesh, listen, budget=24, resolution=32, moves=3000)
    assert result.decisions[-1].endswith("began with planar sections, and by another in less room.")
    assert shares == sorted(shares)
    assert done == [pytest.approx(0.8), pytest.approx(1.0)]
    check_contained(mesh, result)
    check_triangles(result.occluder, 24)


@pytest.mark.parametrize(
    "mesh",
    [torus(), joined(sphere(), box((2.5, 0.2, 2.5), low=(0.0, -0.1, 0.0)))],
    ids=["torus", "thin"],
)
def test_what_sticks_out_at_last_is_cut_back(monkeypatch, mesh):
    """Whatever the searches have come to: here they aim at six times what was asked for, and none
    follows in less room."""
    monkeypatch.setattr("simplifier.refinement.search._CLOSE", 6.0)
    monkeypatch.setattr("simplifier.steps.refine.search_again", lambda *given: None)
    stuck_out = []

    def cut_back(triangles, judge):
        stuck_out.append(judge.views.outlines.overhang(triangles).mean())
        return trimmed(triangles, judge)

    monkeypatch.setattr("simplifier.steps.refine.trimmed", cut_back)
    result = run(mesh, budget=24, resolution=24, moves=3000, overhang=0.005)
    assert max(stuck_out) > 0.0075
    assert simplifier.evaluate(mesh, result.occluder, views=64).overhang.mean <= 0.005
    assert result.decisions[-1].endswith("found by searches, and cut back where it stuck out.")
    check_contained(mesh, result)
    check_triangles(result.occluder, 24)


def test_what_hides_wrongly_is_cut_back_where_nothing_found_is_worth_anything(monkeypatch):
    """Of a tree with leaves, whatever searches found hid too much wrongly by some seeds, and the
    occluder was empty.  Bars hide little unless searches keep to the slab that they lie in."""
    leave_slabs_out(monkeypatch)
    keep_rooms_narrow(monkeypatch)
    monkeypatch.setattr(search, "_NEXT_TO_NOTHING", 0.0)  # nor take more of their room
    mesh = truss()

    def report():
        made = run(mesh, budget=32)
        check_contained(mesh, made)
        check_triangles(made.occluder, 32)
        words = made.decisions[-1].endswith("found by searches, and cut back where it hid wrongly.")
        return words, evaluate_accuracy(mesh, made.occluder, AccuracyOptions(64, 128, exact=True))

    cut, after = report()
    assert cut
    assert after.precision > 0.997
    monkeypatch.setattr(refine_step, "_WORTHLESS", -1.0)
    cut, before = report()
    assert not cut
    assert after.recall > before.recall + 0.2


def one_search(left, is_sheet=False, budget=64, terrain_like=False):
    """A run that has so many seconds left, of a mesh that is a sheet or not."""
    original = SimpleNamespace(
        outlines="finer pictures", needs_outlines=lambda several: True,
        solid=SimpleNamespace(is_sheet=is_sheet),
    )  # fmt: skip
    return refine_step._Run(
        start=np.empty((0, 3, 3)),
        share=0.0,
        looks=SimpleNamespace(
            original=original, surfaces=SimpleNamespace(terrain_like=terrain_like)
        ),
        options=make_options(1.0, budget=budget),
        decimated=False,
        several=False,
        deadline=Deadline(0.0, left, clock=lambda: 0.0),
        tell=lambda begin, end: lambda share, measure, best: False,
        cancelled=lambda: False,
    )


@pytest.mark.parametrize(
    ("left", "budget", "finely"),
    [(0.1, 16, False), (0.3, 16, True), (0.3, 64, True), (0.3, 256, False), (np.inf, 256, True)],
)
def test_overhang_is_judged_in_finer_pictures_where_there_is_time(left, budget, finely):
    """Of 256 triangles these pictures would take half a second from the search."""
    assert one_search(left, budget=budget).outlines == ("finer pictures" if finely else None)


def test_of_a_sheet_little_time_is_left_for_judging():
    """A terrain hid 85 % in 0.05 s, and 11 to 61 in 0.1 s, since its search was not judged."""
    lefts = [0.01, 0.05, 0.2]
    assert [one_search(left).judged for left in lefts] == [False, False, True]
    assert [one_search(left, is_sheet=True).judged for left in lefts] == [False, True, True]
    assert not one_search(np.inf).judged  # a draft has no limit, and nothing to compare with
    assert one_search(np.inf, is_sheet=True, terrain_like=True).judged
    assert not one_search(0.01, is_sheet=True, terrain_like=True).judged
    hurried, solid = (one_search(0.05, is_sheet).time_for(1.0) for is_sheet in (True, False))
    assert hurried.seconds == pytest.approx(0.03)  # the rest is for judging
    assert solid.seconds == pytest.approx(0.041)


class Known:
    """A judge that knows occluders by their lengths: recall and worth of each."""

    precision = 0.999

    def __init__(self, known):
        self.known = known

    def score(self, soup):
        recall, _, precision = (*self.known[len(soup)], 1.0)[:3]
        return SimpleNamespace(recall=recall, precision=precision)

    def worths(self, soups):
        return [self.worth(soup) for soup in soups]

    def recall(self, soup):
        return self.known[len(soup)][0]

    def worth(self, soup):
        return self.known[len(soup)][1]


def found_by(monkeypatch, judge, found, chosen):
    """What is made of a soup that was found where another, or the same, was chosen."""
    monkeypatch.setattr(
        refine_step, "_searched", lambda *given: ([found], Refined(chosen, 1.0, "W."), False)
    )
    run = SimpleNamespace(
        judge=judge, cancelled=lambda: False, deadline=Deadline.after(None),
        looks=SimpleNamespace(room_of=lambda found, budget: SimpleNamespace(bound=2.0)),
    )  # fmt: skip
    return refine_step._found(run, 64, 0.0, 1.0)


@pytest.mark.parametrize(
    ("chosen", "cut", "kept"),
    [
        (1, (0.75, 0.75), 1),  # worth no more than what is chosen, but for chance
        (1, (0.85, 0.84), 3),
        (1, (0.78, 0.90), 1),  # of what was not chosen, and hides less
        (2, (0.70, 0.70), 3),  # of what was chosen, which hid more
    ],
)
def test_what_is_cut_of_others_hides_no_less_than_what_is_chosen(monkeypatch, chosen, cut, kept):
    soups = {count: np.ones((count, 3, 3)) for count in (1, 2, 3)}
    judge = Known({1: (0.80, 0.80), 2: (0.90, 0.50), 3: cut})
    monkeypatch.setattr(refine_step, "is_worth_cutting", lambda *given: True)
    monkeypatch.setattr(refine_step, "trimmed", lambda *given: [soups[3]])
    refined, doubtful = found_by(monkeypatch, judge, soups[2], soups[chosen])
    assert len(refined.triangles) == kept
    assert refined.words.endswith("cut back where it stuck out.") == (kept == 3)
    assert not doubtful


@pytest.mark.parametrize(
    ("worth", "chosen", "precision", "kept"),
    [
        (0.05, 1, 0.999, 3),
        (0.15, 1, 0.999, 1),  # worth something, so it is left
        (0.05, 2, 0.999, 2),  # of what was chosen all the same, which would hide less
        (0.05, 1, 0.998, 1),  # still hides more wrongly than was asked for
        (0.0, 0, 0.998, 3),  # where there is nothing else
    ],
)
def test_what_hid_wrongly_is_cut_back_where_it_was_not_chosen(
    monkeypatch, worth, chosen, precision, kept
):
    soups = {count: np.ones((count, 3, 3)) for count in (0, 1, 2, 3)}
    known = {0: (0.0, 0.0), 1: (0.05, worth), 2: (0.40, worth, 0.98), 3: (0.20, 0.20, precision)}
    judge = Known(known)
    monkeypatch.setattr(refine_step, "is_worth_cutting", lambda *given: False)
    monkeypatch.setattr(refine_step, "made_precise", lambda *given: [soups[3]])
    refined, _ = found_by(monkeypatch, judge, soups[2], soups[chosen])
    assert len(refined.triangles) == kept
    assert refined.words.endswith("cut back where it hid wrongly.") == (kept == 3)


def test_asking_for_less_front_gives_less_and_the_same_bytes_each_time():
    """Of a torus, whose hole a few triangles would close in plain sight of who looks along it."""
    mesh, shares = torus(), []
    for front in (1.0, 0.01, 0.01):
        options = {"preset": "draft", "resolution": 24, "moves": 3000, "overhang": 0.05}
        made = run(mesh, budget=16, front=front, **options).occluder
        directions = random_directions(32, 1)
        shares.append((measure_front(mesh, made, directions).mean, made.vertices.tobytes()))
    assert shares[1] == shares[2]
    assert shares[1][0] < 0.7 * shares[0][0]


@pytest.mark.parametrize(
    ("small", "large", "kept"),
    [
        ((0.80, 0.78), (0.75, 0.74), 1),  # hides more, and is worth more
        ((0.80, 0.72), (0.75, 0.74), 1),  # hides more, for little more of faults
        ((0.80, 0.60), (0.75, 0.74), 2),  # hides more wrongly and beside
        ((0.755, 0.73), (0.75, 0.74), 2),  # no more than chance
        ((0.755, 0.75), (0.75, 0.74), 1),  # a little more, for fewer faults
        ((0.70, 0.69), (0.75, 0.60), 2),  # cleaner, but hides less
    ],
)
def test_fewer_triangles_are_kept_where_they_hide_more(monkeypatch, small, large, kept):
    found = {16: Refined(np.ones((1, 3, 3)), 1.0, "S."), 65: Refined(np.ones((2, 3, 3)), 2.0, "L.")}
    found[32] = found[16]
    monkeypatch.setattr(
        refine_step, "_found", lambda run, budget, begin, end: (found[budget], True)
    )
    run = SimpleNamespace(
        divided=True, cancelled=lambda: False, judge=Known({1: small, 2: large}),
        deadline=Deadline.after(None),
    )  # fmt: skip
    result = refine_step._never_worse(run, 65, 0.0, 1.0)
    assert len(result.triangles) == kept
    assert result.bound == kept
    assert result.words == ("S.  More triangles than that hid less.", "L.")[kept - 1]


@pytest.mark.parametrize(
    ("budget", "divided", "asked"),
    [
        (64, True, [64]),
        (100, True, [100, 32]),
        (256, True, [256, 64]),
        (1024, True, [1024, 256, 64]),
        (256, False, [256]),
    ],
)
def test_which_budgets_are_tried(monkeypatch, budget, divided, asked):
    tried, parts = [], []

    def found(run, budget, begin, end):
        tried.append(budget)
        parts.append((begin, end))
        return Refined(np.ones((2, 3, 3)), 1.0, ""), True

    monkeypatch.setattr(refine_step, "_found", found)
    run = SimpleNamespace(
        divided=divided, cancelled=lambda: False, judge=Known({1: (0, 0), 2: (0.5, 0.5)}),
        deadline=Deadline.after(None),
    )  # fmt: skip
    refine_step._never_worse(run, budget, 0.0, 1.0)
    assert tried == asked
    assert parts[0][0] == 0.0
    assert parts[-1][1] == 1.0
    assert all(end == begin for (_, end), (begin, _) in pairwise(parts))


@pytest.mark.parametrize(
    ("cancelled", "doubtful", "limit"),
    [(True, True, None), (False, False, None), (False, True, 0.01)],
    ids=["cancelled", "without reason", "without time"],
)
def test_no_fewer_are_tried(monkeypatch, cancelled, doubtful, limit):
    large = Refined(np.ones((2, 3, 3)), 1.0, "")
    monkeypatch.setattr(refine_step, "_found", lambda *given: (large, doubtful))
    run = SimpleNamespace(
        divided=True, cancelled=lambda: cancelled, deadline=Deadline.after(limit)
    )  # fmt: skip
    assert refine_step._never_worse(run, 256, 0.0, 1.0) is large


@pytest.mark.slow
def test_more_triangles_of_a_smooth_sheet_hide_no_less():
    """Hills, of which each triangle more is one that may stick out."""
    across = np.arange(40.0)
    x, y = np.meshgrid(across, across, indexing="ij")
    heights = 3.0 * np.sin(0.31 * x) * np.cos(0.23 * y) + 0.08 * x
    corners = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    halves = (
        np.stack([corners, corners + 40, corners + 1], 1),
        np.stack([corners + 40, corners + 41, corners + 1], 1),
    )
    mesh = TriangleMesh.from_soup(
        np.stack([x, y, heights], -1).reshape(-1, 3), np.concatenate(halves)
    )
    lines = random_directions(64, 5)
    recalls = [
        evaluate_accuracy(
            mesh, run(mesh, budget=budget, resolution=32, moves=8000).occluder,
            AccuracyOptions(exact=True), directions=lines,
        ).recall
        for budget in (16, 64, 256)
    ]  # fmt: skip
    assert recalls[1] > recalls[0] - 0.02
    assert recalls[2] > recalls[1] - 0.02


def plate():
    """A petalled plate of a thirtieth of its width, turned."""
    sheet = flower(200)
    below = sheet.vertices - [0.0, 0.0, 0.08]
    rim = np.arange(200)
    side = np.stack([rim, (rim + 1) % 200, (rim + 1) % 200 + 201, rim + 201], axis=1)
    faces = np.concatenate([sheet.faces, sheet.faces[:, ::-1] + 201, triangles_of(side)[:, ::-1]])
    level = TriangleMesh.from_soup(np.concatenate([sheet.vertices, below]), faces)
    return turned(level, Rotation.random(random_state=3).as_matrix())


FLAT, THICK = flower(), plate()


def on_edge(mesh, preset="balanced", seeds=(0,)):
    """Mean recall, and the overhang of the worst view; among 96 views is one in the flower's
    plane."""
    views = 96 if mesh is FLAT else 48
    made = [run(mesh, budget=16, preset=preset, seed=seed).occluder for seed in seeds]
    found = [simplifier.evaluate(mesh, one, views=views, image=160, exact=True) for one in made]
    worst = max(float(one.overhang.by_view.max()) for one in found)
    return np.mean([one.recall for one in found]), worst


@pytest.mark.parametrize("preset", ["draft", "balanced", "best"])
@pytest.mark.parametrize("mesh", [FLAT, THICK], ids=["flat", "thick"])
def test_what_is_thin_sticks_out_by_little_on_edge(mesh, preset):
    # From seed to seed a draft's recall differs by two percent.
    recall, worst = on_edge(mesh, preset, range(8) if preset == "draft" else (0,))
    assert recall > 0.8
    assert worst < (0.1 if mesh is FLAT else 0.02)  # a pixel of a line, or of a band


@pytest.mark.parametrize(("mesh", "most"), [(FLAT, 0.9), (THICK, 0.05)], ids=["flat", "thick"])
def test_no_search_sees_what_sticks_out_there(monkeypatch, mesh, most):
    """A flat sign's occluder was a seventieth of its width thick, which on edge was as much again
    as there was to see."""
    leave_slabs_out(monkeypatch)
    assert on_edge(mesh)[1] > most


def test_bars_hide_more_where_searches_keep_to_their_slab(monkeypatch):
    """Those of a truss were found by chance: 11 to 22 % of what they hide, by three seeds; and 33
    to 43 where searches take more of their room."""

    def recall():
        return simplifier.evaluate(truss(), run(truss(), budget=32).occluder, views=64).recall

    keep_rooms_narrow(monkeypatch)
    within = recall()
    leave_slabs_out(monkeypatch)
    assert within > 0.5 > 1.3 * recall()
    monkeypatch.setattr(search, "_NEXT_TO_NOTHING", 0.0)
    assert recall() < 0.25


@pytest.mark.parametrize("preset", ["draft", "balanced"])
def test_what_stands_on_a_ground_does_not_tilt_its_occluder(preset):
    """On edge a tilted one covers a multiple of what there is to see."""
    found = simplifier.simplify(town(), preset=preset, budget=16).measure()
    assert found.recall > 0.99
    assert found.overhang.mean < 0.005
    assert found.overhang.by_view.max() < 0.1


@pytest.mark.parametrize("preset", ["draft", "balanced"])
def test_a_sheet_has_all_the_room_that_its_bound_allows(monkeypatch, preset):
    """Within a cell's diagonal of it, waves in few triangles have holes: of 24 nothing was left."""
    mesh = waves()
    wide = run(mesh, budget=24, preset=preset)
    cell = wide.solid.core.cell_size
    off = deviation(wide.occluder, mesh, wide.solid.interior)
    assert off <= wide.occluder.error_bound <= ERROR_VOXELS * cell
    check_contained(mesh, wide)
    wide_found = simplifier.evaluate(mesh, wide.occluder, views=64)
    keep_rooms_narrow(monkeypatch)
    narrow = run(mesh, budget=24, preset=preset)
    narrow_found = simplifier.evaluate(mesh, narrow.occluder, views=64)
    assert wide_found.recall > narrow_found.recall + 0.3
    assert wide_found.overhang.mean < 0.015
