"""Chains of real occluders: their order, what is left out, and how a run is ended."""

from __future__ import annotations

import itertools
import threading
from dataclasses import replace

import numpy as np
import pytest

from simplifier.accuracy.deviation import SLACK, deviation
from simplifier.device import remembering
from simplifier.errors import CancelledError, OptionError
from simplifier.geometry.occluder import Occluder
from simplifier.lods import levels as making
from simplifier.lods.level_plan import plan_levels
from simplifier.lods.levels import simplify_levels
from simplifier.options.simplify import LodOptions
from simplifier.options.stages import ERROR_VOXELS, SolidOptions, make_options
from simplifier.pipeline import Simplification
from simplifier.progress import STAGES, Stopwatch
from simplifier.steps.solid import solidify
from tests.solids import blob, box, sphere, torus

WASTEFUL = 40  # triangles, at least
QUICK = {"preset": "draft", "moves": 1500, "overhang": 1.0}


def made_of(mesh, lods, listener=None, cancel=None, **options):
    longest = float(mesh.extent.max())
    finest = make_options(
        longest,
        **{**QUICK, "lods": lods.lods, "error_bounds": lods.error_bounds, **options},
    )
    return simplify_levels(mesh, plan_levels(longest, finest, lods), listener, cancel)


def test_a_mesh_is_drawn_once_to_judge_all_levels(monkeypatch):
    drawn, draw = [], remembering.coverage_masks

    def counted(vertices, faces, projections, rows, *others):
        drawn.append((len(faces), len(projections), rows))
        return draw(vertices, faces, projections, rows, *others)

    monkeypatch.setattr(remembering, "coverage_masks", counted)
    mesh = torus()
    made = made_of(mesh, LodOptions(lods=3), resolution=32, budget=48)
    seen = drawn.count((len(mesh.faces), 64, 256))
    assert (len(made.chain.levels), seen) == (3, 1)


def check_chain(mesh, chain):
    """Errors rise, triangles do not, switch distances rise, and every promise is kept."""
    bounds = [level.error_bound for level in chain.levels]
    triangles = [level.triangles for level in chain.levels]
    distances = [chain.switch_distance(index) for index in range(len(bounds))]
    assert all(a < b for a, b in itertools.pairwise(bounds))
    assert all(a >= b for a, b in itertools.pairwise(triangles))
    assert all(a < b for a, b in itertools.pairwise(distances))
    assert all(level.deviation <= level.error_bound for level in chain.levels)
    # In a finer grid than any of theirs, too; the surface of closed solids is within a voxel of it.
    solid = solidify(mesh, SolidOptions(64), Stopwatch())
    cell = solid.filled.cell_size
    for level in chain.levels:
        far = deviation(level.occluder, mesh, solid.interior)
        assert far <= level.error_bound + SLACK * cell


@pytest.mark.sweep(3)
@pytest.mark.parametrize("mesh", [sphere(), torus(), blob(1)], ids=["sphere", "torus", "blob"])
def test_a_chain_of_a_closed_solid(mesh):
    made = made_of(mesh, LodOptions(lods=4), resolution=32, budget=48)
    check_chain(mesh, made.chain)
    assert len(made.chain.levels) >= 2
    assert len(made.chain.levels) + len(made.chain.left_out) == 4
    assert made.occluder is made.chain.levels[0].occluder
    assert not made.interrupted


def test_a_box_needs_one_level_where_the_grid_does_not_matter():
    """12 triangles at 64, 32 and 16 voxels hide it all: the coarser ones bring nothing."""
    made = made_of(box(), LodOptions(lods=3), resolution=64, preset="balanced", moves=None)
    (level,) = made.chain.levels
    assert level.triangles == 12
    assert [one.resolution for one in made.chain.left_out] == [32, 16]
    assert all("no better than the finer level" in one.reason for one in made.chain.left_out)


@pytest.fixture
def wasteful(monkeypatch):
    """``wasteful(larger)``: the levels of a box of which the finer is split into more triangles,
    and the coarser so many times as large."""

    def levels(larger):
        def split(mesh, options, *others):
            made = real(mesh, options, *others)
            if options.solid.resolution < 32:
                grown = replace(made.occluder, vertices=made.occluder.vertices * larger)
                return replace(made, occluder=grown)
            soup = made.occluder.vertices[made.occluder.faces]
            while len(soup) < WASTEFUL:
                middle = soup.mean(axis=1)
                thirds = [
                    np.stack([soup[:, i], soup[:, (i + 1) % 3], middle], axis=1) for i in range(3)
                ]
                soup = np.concatenate(thirds)
            finer = Occluder.of(soup, made.occluder.error_bound, {})
            return Simplification(finer, made.solid, made.warnings)

        monkeypatch.setattr(making, "simplify_mesh", split)
        options = {"resolution": 32, "preset": "balanced", "moves": None, "overhang": 0.005}
        return made_of(box(), LodOptions(lods=2), **options)

    real = making.simplify_mesh
    return levels


def test_a_coarser_level_takes_over_the_bound_of_a_finer_that_it_keeps(wasteful):
    """A finer level of more triangles that hides no more is replaced, and the promise goes on."""
    made = wasteful(1.0)
    (level,) = made.chain.levels
    assert level.triangles < WASTEFUL
    assert level.resolution == 16
    assert level.error_bound == pytest.approx(2.0 * np.sqrt(3.0) / 32.0, rel=1e-6)
    assert made.solid.filled.cell_size == pytest.approx(1.0 / 32.0, rel=1e-6)
    (gone,) = made.chain.left_out
    assert (gone.resolution, "keeps its error bound" in gone.reason) == (32, True)


def test_a_coarser_level_that_sticks_out_more_replaces_none(wasteful):
    """The finest one alone kept to the overhang asked for, and was left out."""
    made = wasteful(1.01)
    assert [level.resolution for level in made.chain.levels] == [32, 16]
    assert made.chain.left_out == ()


def test_a_coarser_level_that_strays_less_promises_what_its_grid_does(monkeypatch):
    """A time limit left the finest unrefined; chains came out whose bounds did not rise."""
    mesh, real = blob(), making.simplify_mesh
    proved = {32: ERROR_VOXELS / 32.0, 16: 0.9 * ERROR_VOXELS / 32.0}

    def unrefined(mesh, options, *others):
        made = real(mesh, options, *others)
        bound = float(mesh.extent.max()) * proved[options.solid.resolution]
        return replace(made, occluder=replace(made.occluder, error_bound=bound))

    monkeypatch.setattr(making, "simplify_mesh", unrefined)
    made = made_of(mesh, LodOptions(lods=2), resolution=32, budget=48)
    finer, coarser = made.chain.levels
    assert coarser.error_bound == pytest.approx(2.0 * finer.error_bound, rel=1e-6)
    check_chain(mesh, made.chain)


def test_the_order_of_bounds_does_not_matter():
    chains = [
        made_of(blob(), LodOptions(error_bounds=bounds), budget=24).chain
        for bounds in ((0.2, 0.8, 0.4), (0.8, 0.4, 0.2))
    ]
    figures = [
        [(level.error_bound, level.occluder.vertices.tolist()) for level in chain.levels]
        for chain in chains
    ]
    assert figures[0] == figures[1]
    assert chains[0].left_out == chains[1].left_out
    asked = [0.2, 0.4, 0.8]
    assert all(any(level.error_bound <= b for b in asked) for level in chains[0].levels)
    check_chain(blob(), chains[0])


@pytest.mark.parametrize(
    ("empty", "kept", "left"),
    [({16, 8, 4}, [16], [8, 4]), ({16}, [8, 4], [16]), ({4}, [16, 8], [4])],
)
def test_levels_that_hide_nothing(monkeypatch, empty, kept, left):
    """They go, unless there is no other."""
    real = making.simplify_mesh

    def emptied(mesh, options, *others):
        made = real(mesh, options, *others)
        if options.solid.resolution not in empty:
            return made
        nothing = Occluder.of(np.empty((0, 3, 3)), made.occluder.error_bound, {})
        return Simplification(nothing, made.solid, made.warnings)

    monkeypatch.setattr(making, "simplify_mesh", emptied)
    chain = made_of(blob(), LodOptions(lods=3), resolution=16, budget=32, moves=100).chain
    assert [level.resolution for level in chain.levels] == kept
    assert [one.resolution for one in chain.left_out] == left
    assert {one.reason for one in chain.left_out} == {"it hides nothing"}


def test_listeners_hear_which_level_it_is():
    heard = []
    made_of(sphere(), LodOptions(lods=3), heard.append, resolution=16, budget=16, moves=100)
    assert {progress.levels for progress in heard} == {3}
    assert [progress.level for progress in heard] == sorted(progress.level for progress in heard)
    assert {progress.level for progress in heard} == {0, 1, 2}
    assert {progress.stage for progress in heard} <= set(STAGES)
    seconds = [progress.seconds for progress in heard]
    assert seconds == sorted(seconds)


def test_the_best_so_far_is_that_of_the_level():
    largest = {}

    def listen(progress):
        if progress.best is not None:
            triangles = progress.best()
            assert triangles.min() > -1.5  # of the world, at any level's resolution
            assert triangles.max() < 1.5
            largest[progress.level] = len(triangles)

    plan = LodOptions(lods=2)
    made_of(sphere(), plan, listen, resolution=16, budget=16, moves=100)
    assert largest == {0: 16, 1: 8}


def test_a_cancel_keeps_the_levels_so_far():
    cancel = threading.Event()

    def listen(progress):
        if progress.level == 1:
            cancel.set()

    made = made_of(sphere(), LodOptions(lods=3), listen, cancel, resolution=16, moves=100)
    assert made.interrupted
    assert [level.resolution for level in made.chain.levels] == [16]
    assert [one.resolution for one in made.chain.left_out] == [8, 4]
    assert all("interrupted" in one.reason for one in made.chain.left_out)


def test_a_cancel_while_refining_keeps_that_level():
    cancel = threading.Event()

    def listen(progress):
        if progress.level == 0 and progress.stage == "refine" and progress.share > 0.0:
            cancel.set()

    made = made_of(blob(), LodOptions(lods=2), listen, cancel, resolution=24, moves=100_000_000)
    assert made.interrupted
    assert len(made.chain.levels) == 1
    assert "interrupted: this is the best occluder so far" in made.warnings


def test_a_cancel_before_the_finest_is_there():
    cancel = threading.Event()
    cancel.set()
    with pytest.raises(CancelledError):
        made_of(sphere(), LodOptions(lods=2), None, cancel, resolution=16)


def test_a_time_limit_is_shared_out(monkeypatch):
    given = []
    real = making.simplify_mesh

    def noted(mesh, options, *others):
        given.append(options.time_limit)
        return real(mesh, options, *others)

    monkeypatch.setattr(making, "simplify_mesh", noted)
    made = made_of(sphere(), LodOptions(lods=3), resolution=32, time_limit=2.0, moves=None)
    assert len(given) + len(made.chain.left_out) >= 3  # a slow machine has no time for the last
    assert given[0] == pytest.approx(0.9 * 2.0 * 32 / 56, rel=0.01)
    assert all(0.0 < seconds < 2.0 for seconds in given)
    check_chain(sphere(), made.chain)


def test_no_time_for_a_second_level():
    made = made_of(sphere(), LodOptions(lods=3), resolution=32, time_limit=1e-4, moves=None)
    assert len(made.chain.levels) == 1
    assert {one.reason for one in made.chain.left_out} == {"the time limit was up"}


def test_wholly_inside_is_refused():
    with pytest.raises(OptionError, match="wholly inside"):
        made_of(box(), LodOptions(lods=2), conservative=True)
