"""What the scene's own facts promise: viewers, smallest hole, conservative, shrink."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplifier
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import deviation
from simplifier.errors import BackendUnavailableError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.voxelize import mark_triangles
from simplifier.options.stages import make_options
from simplifier.pipeline import simplify_mesh
from tests.segments import crossings, outside
from tests.solids import blob, box, joined, sphere, table, torus

QUICK = {"budget": 24, "resolution": 32, "preset": "draft"}


def run(mesh, **options):
    return simplify_mesh(mesh, make_options(float(mesh.extent.max()), **{**QUICK, **options}))


def judged(mesh, occluder, views):
    return evaluate_accuracy(mesh, occluder, AccuracyOptions(views, 96, exact=True))


def check_precision_is_1(mesh, occluder, views=4096):
    """In every single view; and something is hidden."""
    report = judged(mesh, occluder, views)
    assert report.precision == 1.0
    assert (report.precision_by_view == 1.0).all()
    assert report.recall > 0.02


CLOSED = {
    "box": box(),
    "sphere": sphere(),
    "torus": torus(),
    "blob": blob(),
    "other blob": blob(3),
    "overlapping": joined(blob(1), TriangleMesh.from_soup(blob(2).vertices + 0.7, blob(2).faces)),
}  # fmt: skip


def without_faces(mesh, left_out):
    return TriangleMesh.from_soup(mesh.vertices, np.delete(mesh.faces, list(left_out), axis=0))


@pytest.mark.sweep(3)
@pytest.mark.parametrize("moves", [0, 1000])
@pytest.mark.parametrize("name", CLOSED)
def test_conservative_never_hides_what_a_closed_mesh_does_not(name, moves):
    mesh = CLOSED[name]
    result = run(mesh, conservative=True, moves=moves)
    check_precision_is_1(mesh, result.occluder, 4096 if moves else 128)
    assert result.warnings == ()
    assert result.occluder.error_bound == 0.0
    solid = result.solid
    assert deviation(result.occluder, mesh, solid.interior, solid.core.cell_size) == 0.0


OPEN = {
    "a box without a side": box(without=[3]),
    "a ball with holes": without_faces(sphere(), [5, 6, 7, 40, 41, 90]),
}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("moves", [0, 1000])
@pytest.mark.parametrize("name", OPEN)
def test_conservative_is_never_seen_past_an_open_mesh(name, moves):
    mesh = OPEN[name]
    result = run(mesh, conservative=True, moves=moves)
    assert result.solid.open
    assert result.occluder.error_bound == 0.0
    views = 4096 if moves else 128
    report = simplifier.evaluate(mesh, result.occluder, views=views, image=96, exact=True)
    assert (report.accuracy.precision_by_view == 1.0).all()
    assert report.overhang.stick_out == 0.0
    assert report.accuracy.recall > (0.1 if moves else 0.01)


@pytest.mark.slow
def test_conservative_is_hardly_ever_seen_past_a_sieve():
    """Its holes line up along a few of all lines of sight, which not all have been looked along."""
    sieve = without_faces(blob(2), range(0, 400, 9))
    report = simplifier.evaluate(sieve, run(sieve, conservative=True).occluder, views=512)
    assert report.accuracy.precision > 1.0 - 1e-6
    assert report.overhang.mean < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["buddha_113k.ply", "dragon_871k.ply"])
@pytest.mark.parametrize("resolution", [64, 128])
def test_conservative_on_a_statue(asset, name, resolution):
    mesh = simplifier.load(asset(name))
    occluder = run(mesh, conservative=True, budget=64, resolution=resolution).occluder
    check_precision_is_1(mesh, occluder)


def test_the_default_hides_a_little_wrongly():
    """Else the tests above would show nothing."""
    assert judged(blob(), run(blob()).occluder, 256).precision < 1.0


@pytest.mark.sweep(3)
@pytest.mark.parametrize("options", [{"conservative": True}, {"shrink": 0.1}])
@pytest.mark.parametrize("slicer", ["cpu", "gl"])
@pytest.mark.parametrize("moves", [0, 400])
@pytest.mark.parametrize("trim", ["gain", "area"])
def test_triangles_touch_inner_voxels_only(options, slicer, moves, trim):
    try:
        result = run(blob(), slicer=slicer, moves=moves, trim=trim, **options)
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    # What is moved, and gives up nothing on purpose, keeps to finer voxels than the core's.
    fine = moves > 0 and "shrink" not in options
    core, occluder = result.solid.interior if fine else result.solid.core, result.occluder
    assert core.shape[0] == (512 // 32 // 2 if fine else 1) * result.solid.core.shape[0]
    assert len(occluder.faces) > 0
    touched = np.zeros(core.shape, dtype=np.bool_)
    vertices = np.ascontiguousarray(core.to_grid(occluder.vertices))
    mark_triangles(
        vertices, occluder.faces.copy(), np.zeros(3), 1.0, 0, len(occluder.faces), touched
    )
    assert not (touched & ~core.inside).any()


def test_on_the_ground_it_stays_above_it():
    # 13 voxels for 12.5 in height: the grid reaches a quarter of a voxel under the mesh.
    mesh = box((32.0, 12.5, 32.0), without=[2])
    result = run(mesh, conservative=True, ground=True, moves=2000)
    assert len(result.occluder.faces) > 0
    assert result.occluder.vertices[:, 1].min() > 0.0
    check_precision_is_1(mesh, result.occluder, 256)


def across(generator, lines, length):
    """A step of at most ``length`` to the side of each line, most of them nearly that long."""
    step = np.cross(lines, generator.normal(size=lines.shape))
    share = generator.random((len(lines), 1)) ** 0.1
    return length * share * step / np.linalg.norm(step, axis=1, keepdims=True)


def blocked_lines(occluder, extent, length, generator, count=3000):
    """Viewers, viewers a step aside, and goals: lines through points of the occluder.

    Chosen to make a violation likely: points near its corners, goals far behind them.
    """
    corners = occluder.vertices[occluder.faces[generator.integers(0, len(occluder.faces), count)]]
    points = (corners * generator.dirichlet([0.2] * 3, count)[:, :, None]).sum(axis=1)
    lines = generator.normal(size=(count, 3))
    lines *= (
        extent * generator.uniform(0.2, 3.0, (count, 1)) / np.linalg.norm(lines, axis=1)[:, None]
    )
    viewers = points - lines
    goals = points + lines * generator.uniform(0.5, 30.0, (count, 1))
    return viewers, viewers + across(generator, lines, length), goals


def seen_in_spite(mesh, occluder, length, seed):
    """How many lines of sight the occluder blocks, and how many the mesh lets through nearby."""
    generator = np.random.default_rng(seed)
    extent = float(mesh.extent.max())
    viewers, others, goals = blocked_lines(occluder, extent, length, generator)
    # Viewers are outside of the solid; what they look at may be anywhere.
    free = outside(viewers, mesh) & outside(others, mesh)
    seen = crossings(others, goals, mesh.vertices[mesh.faces]) == 0
    return int(free.sum()), int((free & seen).sum())


THEOREM = {"sphere": sphere(rings=10), "torus": torus(1.0, 0.5, 20, 10), "blob": blob(5, rings=10)}


@pytest.mark.sweep(3)
@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("name", THEOREM)
def test_what_a_shrunk_occluder_hides_it_hides_from_all_points_nearby(name, share):
    mesh = THEOREM[name]
    length = share * (1.0 if name == "torus" else 2.0)
    occluder = run(mesh, shrink=length, moves=1000).occluder
    blocked, seen = seen_in_spite(mesh, occluder, length, seed=1)
    assert blocked > 1000
    assert seen == 0


def test_without_shrink_a_step_aside_uncovers():
    """Else the test above would show nothing."""
    blocked, seen = seen_in_spite(THEOREM["torus"], run(THEOREM["torus"]).occluder, 0.2, seed=1)
    assert blocked > 1000
    assert seen > 50


def test_shrink_on_the_ground_holds_for_viewers_above_it():
    mesh, length = box((2.0, 1.0, 2.0), without=[2]), 0.2
    occluder = run(mesh, shrink=length, ground=True).occluder
    assert occluder.vertices[:, 1].min() < 0.1  # solid ground is no edge
    viewers, others, goals = blocked_lines(occluder, 2.0, length, np.random.default_rng(0), 8000)
    above = (viewers[:, 1] >= 0.0) & (others[:, 1] >= 0.0) & (goals[:, 1] >= 0.0)
    inside = ((others > (0, -1, 0)) & (others < (2, 1, 2))).all(axis=1)
    chosen = above & ~inside
    assert chosen.sum() > 200
    assert (crossings(others[chosen], goals[chosen], mesh.vertices[mesh.faces]) > 0).all()


def test_shrink_0_is_conservative_and_above_implies_it():
    few = {"moves": 300}
    plain = run(blob(), conservative=True, **few)
    same = run(blob(), conservative=True, shrink=0.0, **few)
    assert np.array_equal(plain.occluder.vertices, same.occluder.vertices)
    shrunk = run(blob(), shrink=0.05, moves=0)
    assert shrunk.solid.reach == plain.solid.reach == 0
    assert (shrunk.solid.core.inside <= plain.solid.core.inside).all()
    assert run(blob(), shrink=0.0, moves=0).solid.reach == 1


@pytest.mark.parametrize("slicer", ["cpu", "gl"])
@pytest.mark.parametrize("trim", ["gain", "area"])
def test_nothing_wholly_inside(slicer, trim):
    sheet = box((1, 0, 1), without=[0, 1, 3, 4, 5])
    try:
        result = run(sheet, conservative=True, slicer=slicer, trim=trim)
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    # Its own two triangles hide all, and nothing else.
    assert len(result.occluder.faces) == 2
    assert sorted(result.occluder.vertices.tolist()) == sorted(sheet.vertices.tolist())
    (warning,) = result.warnings
    assert warning == (
        "no voxel lies wholly inside, so only triangles of the mesh itself hide; raise the"
        " resolution or, if the mesh encloses nothing, allow some overhang"
    )
    assert result.occluder.error_bound == 0.0


def test_nothing_so_deep_inside():
    result = run(box(), shrink=0.6)
    assert len(result.occluder.faces) == 0
    (warning,) = result.warnings
    assert warning.startswith("no voxel is as deep inside as shrink 0.6")
    most = float(warning.split("choose at most ")[1].split(",")[0])
    assert 0.3 < most < 0.5
    assert run(box(), shrink=0.99 * most).solid.core.count > 0
    thin = run(table(), shrink=0.6).warnings[-1]
    assert "leave it out, or raise the resolution" in thin


@pytest.mark.parametrize("moves", [0, 300])
def test_a_smallest_hole_closes_a_window(moves):
    walls = joined(box(without=[5]), *window(0.2))
    open_ = run(walls, moves=moves, fill="flood")
    closed = run(walls, smallest_hole=0.22, moves=moves, fill="flood")
    assert open_.solid.closed_by == ()
    (closing,) = closed.solid.closed_by
    assert closing.by == "smallest_hole"
    assert closing.voxels == pytest.approx(30**3, rel=0.05)
    assert closed.solid.filled.count - open_.solid.filled.count == closing.voxels
    assert judged(walls, closed.occluder, 64).recall > 0.8
    solid = closed.solid
    found = deviation(closed.occluder, walls, solid.interior)
    assert found <= closed.occluder.error_bound


def window(size):
    """Four sheets around a square window in the side z = 1 of the unit box."""
    low, high = (1.0 - size) / 2.0, (1.0 + size) / 2.0
    spans = [(0, low, 0, 1), (high, 1, 0, 1), (low, high, 0, low), (low, high, high, 1)]
    return [
        box((x1 - x0, y1 - y0, 0.0), (x0, y0, 1.0), without=[0, 1, 2, 3, 4])
        for x0, x1, y0, y1 in spans
    ]


FACTS = [
    {"smallest_hole": 0.21},
    {"conservative": True},
    {"shrink": 0.08},
    {"smallest_hole": 0.21, "shrink": 0.1, "viewers": "above", "up": "z"},
]


def scaled(mesh, factor):
    return TriangleMesh.from_soup(mesh.vertices * factor, mesh.faces)


def check_scale(mesh, facts, factor):
    lengths = {
        name: value * factor if isinstance(value, float) else value for name, value in facts.items()
    }
    here, there = run(mesh, **facts), run(scaled(mesh, factor), **lengths)
    assert np.array_equal(here.occluder.faces, there.occluder.faces)
    assert there.occluder.vertices == pytest.approx(here.occluder.vertices * factor, rel=1e-9)
    assert there.solid.closed_by == here.solid.closed_by
    assert np.array_equal(there.solid.core.inside, here.solid.core.inside)
    return here.occluder, there.occluder


@pytest.mark.sweep(3)
@pytest.mark.parametrize("facts", FACTS)
@pytest.mark.parametrize("factor", [1000.0, 1e-3])
def test_lengths_scale_with_the_mesh(facts, factor):
    check_scale(joined(box(without=[5]), *window(0.2)), facts, factor)


@settings(max_examples=8)
@given(st.integers(-40, 40), st.integers(0, 2**32 - 1))
def test_scale_by_a_power_of_two_is_exact(power, seed):
    facts = {"smallest_hole": 0.125, "shrink": 0.0625, "moves": 200, "resolution": 20}
    here, there = check_scale(blob(seed % 50, rings=8), facts, 2.0**power)
    assert np.array_equal(there.vertices, here.vertices * 2.0**power)


def test_viewers_above_close_the_ground():
    mesh = box(without=[4])
    above = run(mesh, viewers="above", up="z")
    ground = run(mesh, ground=True, up="z")
    assert [closing.by for closing in above.solid.closed_by] == ["ground"]
    assert np.array_equal(above.solid.filled.inside, ground.solid.filled.inside)


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_viewers_above_look_level_or_down(up):
    mesh, occluder = table(), run(table(), ground=True, up=up).occluder
    options = AccuracyOptions(64, 64, 500, viewers="above", up=up)
    report = evaluate_accuracy(mesh, occluder, options)
    everywhere = evaluate_accuracy(mesh, occluder, AccuracyOptions(64, 64, 500))
    assert (report.directions[:, "xyz".index(up)] <= 0.0).all()
    assert (everywhere.directions[:, "xyz".index(up)] > 0.0).any()
    # The same lines of sight, some from the other end.
    assert (np.abs((report.directions * everywhere.directions).sum(axis=1)) > 1.0 - 1e-12).all()
    same = simplifier.evaluate(
        mesh, occluder, views=64, image=64, quads=500, viewers="above", up=up
    ).accuracy
    assert np.array_equal(same.recall_by_view, report.recall_by_view)


def test_from_above_or_below_silhouettes_are_mirror_images():
    mesh, occluder = blob(), run(blob()).occluder
    reports = [
        evaluate_accuracy(mesh, occluder, AccuracyOptions(48, 64, exact=True, viewers=viewers))
        for viewers in ("all", "above")
    ]
    assert reports[0].recall_by_view == pytest.approx(reports[1].recall_by_view, abs=0.01)
