"""What points see past prisms: as a plain search over all walls says, and never more than is so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.visibility.checking.exact_view import (
    Prisms,
    flat_outline,
    prisms_of,
    seen_along,
    seen_from,
)
from tests.hierarchy.scenes import moved, scene_of, turned
from tests.solids import box, joined
from tests.visibility.scenes import PUZZLES

SEEDS = st.integers(0, 2**32 - 1)
SMALL = 1e-5  # lengths and shares, between which the reference does not ask


def rectangle(x0, y0, x1, y1):
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=np.float64)


def any_plan(rng, kind):
    """A rectangle, a turned one, a ragged star or an L around a place of 100 x 100."""
    x, y = rng.uniform(0.0, 100.0, 2)
    if kind == 0:
        return rectangle(x, y, x + rng.uniform(1.0, 15.0), y + rng.uniform(1.0, 15.0))
    if kind == 1:
        return rectangle(-6.0, -3.0, 6.0, 3.0) @ turned("z", rng.uniform(0, 360))[:2, :2] + [x, y]
    if kind == 2:
        angles = (np.arange(7) + rng.uniform(0.1, 0.9, 7)) * 2.0 * np.pi / 7
        radii = rng.uniform(1.0, 8.0, (7, 1))
        return np.array([x, y]) + radii * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corner = np.array([[0, 0], [9, 0], [9, 3], [4, 3], [4, 8], [0, 8]], dtype=np.float64)
    return corner + np.array([x, y])


def spans_of(prisms, eye, angle):
    """By prism the (from, to) along a line on which it is within the plan, ascending."""
    ahead = np.array([math.cos(angle), math.sin(angle)])
    spans = []
    for prism in range(len(prisms)):
        edges = prisms.edges[prisms.offsets[prism] : prisms.offsets[prism + 1]] - eye[:2]
        sides = ahead[0] * edges[:, :, 1] - ahead[1] * edges[:, :, 0]
        crossing = edges[(sides[:, 0] > 0) != (sides[:, 1] > 0)]
        part = sides[(sides[:, 0] > 0) != (sides[:, 1] > 0)]
        share = part[:, 0] / (part[:, 0] - part[:, 1])
        along = np.sort(
            (crossing[:, 0] * (1 - share)[:, None] + crossing[:, 1] * share[:, None]) @ ahead
        )
        spans.append(along.reshape(-1, 2))
    return spans


def in_view(prisms, eye, angle, slack):
    """The objects of which an end of a roof is steeper by ``slack`` than what all others hide."""
    spans, rises = spans_of(prisms, eye, angle), prisms.tops - eye[2]
    seen = set()
    for prism in range(len(prisms)):
        for place in spans[prism].ravel():
            if place <= 0.0:
                continue
            hides = [
                max(rises[other] / max(start, SMALL), rises[other] / min(end, place))
                for other in range(len(prisms))
                if other != prism
                for start, end in spans[other]
                if start < place - SMALL and end > 0.0
            ]
            slope = rises[prism] / place
            if slope > max(hides, default=-np.inf) + slack * (1.0 + abs(slope)):
                seen.add(prism)
    return seen


def inside_any(prisms, eye):
    spans = spans_of(prisms, eye, 0.1234)
    within = [(each[:, 0] <= 0.0) & (each[:, 1] >= 0.0) for each in spans]
    return any(each.any() and top >= eye[2] for each, top in zip(within, prisms.tops, strict=True))


@given(SEEDS, st.sampled_from([0.5, 8.0, 40.0]), st.booleans())
def test_along_any_line_the_same_as_a_plain_search(seed, eye_height, ragged):
    rng = np.random.default_rng(seed)
    plans = [any_plan(rng, rng.integers(0, 4) if ragged else 0) for _ in range(rng.integers(1, 25))]
    prisms = Prisms.of_outlines(plans, rng.uniform(1.0, 30.0, len(plans)))
    eye = np.array([*rng.uniform(-20.0, 120.0, 2), eye_height])
    for angle in rng.uniform(-4.0, 4.0, 6):
        seen = set(np.flatnonzero(~np.isnan(seen_along(prisms, eye[None], np.array([angle]))[0])))
        if inside_any(prisms, eye):
            assert not seen
            continue
        assert seen <= in_view(prisms, eye, angle, -1e-7)
        # A column around the eye hides itself in the reference alone.
        if not any((each[:, 0] <= 0).any() for each in spans_of(prisms, eye, angle)):
            assert in_view(prisms, eye, angle, 1e-5) <= seen


@given(SEEDS, st.sampled_from([2.0, 18.0, 60.0]))
def test_touching_houses_leave_no_crack(seed, eye_height):
    rng = np.random.default_rng(seed)
    city = generated_city(2, seed=seed)
    prisms, cells = prisms_of(city, "z"), street_cells(city, 1, seed=seed)
    eye = np.array([*cells.low[0, :2], eye_height]) - prisms.origin
    found = seen_from(prisms, eye[None], 40)[0]
    for prism in np.flatnonzero(~np.isnan(found)):
        assert prism in in_view(prisms, eye, found[prism], -1e-7)
    for angle in [0.0, np.pi / 2, *rng.uniform(0.0, 6.3, 4)]:  # also along walls
        seen = np.flatnonzero(~np.isnan(seen_along(prisms, eye[None], np.array([angle]))[0]))
        assert set(seen) <= in_view(prisms, eye, angle, -1e-7)


def test_nothing_is_seen_behind_an_endless_wall_and_all_over_it():
    rng = np.random.default_rng(5)
    houses = [any_plan(rng, 0) for _ in range(40)]
    wall = rectangle(-12.0, -1e6, -11.0, 1e6)
    prisms = Prisms.of_outlines([wall, *houses], np.array([20.0, *rng.uniform(1.0, 19.0, 40)]))
    eyes = np.array([[-60.0, 50.0, 2.0], [-30.0, 0.0, 19.0], [-30.0, 50.0, 500.0]])
    seen = ~np.isnan(seen_from(prisms, eyes, 300, near=1e9))
    assert seen[:, 0].all()
    assert not seen[:2, 1:].any()
    assert seen[2, 1:].sum() > 30


def test_all_is_seen_that_stands_apart_around_an_empty_plain():
    turns = np.arange(60) * 2.0 * np.pi / 60
    plans = [
        rectangle(x - 2.0, y - 2.0, x + 2.0, y + 2.0)
        for x, y in 300.0 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    ]
    prisms = Prisms.of_outlines(plans, np.full(60, 8.0))
    for height in (1.0, 8.0, 90.0):
        assert not np.isnan(seen_from(prisms, np.array([[5.0, 3.0, height]]), 720)).any()
        assert not np.isnan(seen_from(prisms, np.array([[5.0, 3.0, height]]), 0, near=1e3)).any()


def test_corners_lead_to_gaps_that_no_even_direction_meets():
    prisms = Prisms.of_outlines(
        [rectangle(10, -50, 11, 0.4), rectangle(10, 0.401, 11, 50), rectangle(500, 0, 505, 40)],
        np.array([30.0, 30.0, 10.0]),
    )
    eye = np.array([[0.0, 0.4005, 2.0]])
    assert np.isnan(seen_along(prisms, eye, np.arange(0.01, 6.28, 0.01)))[0, 2]
    assert not np.isnan(seen_from(prisms, eye, 100))[0, 2]


def test_corners_of_what_corners_led_to_lead_further():
    gap = 0.0005
    prisms = Prisms.of_outlines(
        [
            rectangle(200, 0.0062, 201, 0.02),
            rectangle(100, 0.0035, 101, 5),
            rectangle(10, -50, 11, -gap),
            rectangle(10, gap, 11, 50),
        ],
        np.array([10.0, 10.0, 30.0, 30.0]),
    )
    eye = np.array([[0.0, 0.0, 2.0]])
    assert not np.isnan(seen_from(prisms, eye, 100, near=0.0)).any()


def test_no_line_passes_where_two_corners_meet():
    prisms = Prisms.of_outlines(
        [rectangle(0, -10, 10, 0), rectangle(10, 0, 20, 10), rectangle(30, -25, 35, -15)],
        np.full(3, 9.0),
    )
    eye = np.array([[5.0, 5.0, 2.0]])
    for off in (0.0, 1e-12, -1e-12, 1e-3, -1e-3):
        found = np.isnan(seen_along(prisms, eye, np.array([off - np.pi / 4])))[0]
        assert found[2]
        assert found.all() == (abs(off) < 1e-9)
    assert np.isnan(seen_from(prisms, eye, 720))[0, 2]


def test_a_far_edge_is_seen_where_a_higher_house_touches_it():
    screen, higher, low = (
        rectangle(10, -9, 11, 9),
        rectangle(40, -9, 60, 9),
        rectangle(20, -9, 40, 9),
    )
    prisms = Prisms.of_outlines([screen, higher, low], np.array([20.0, 25.0, 5.0]))
    eye = np.array([[0.0, 0.0, 30.0]])
    assert not np.isnan(seen_along(prisms, eye, np.array([0.01]))).any()


def test_from_above_a_roof_nothing_is_seen_that_is_within_its_house():
    prisms = Prisms.of_outlines(
        [rectangle(-10, -10, 10, 10), rectangle(5, -1, 6, 1), rectangle(8, -1, 30, 1)],
        np.array([20.0, 15.0, 15.0]),
    )
    seen = ~np.isnan(seen_from(prisms, np.array([[0.0, 0.0, 30.0]]), 90))
    assert seen.tolist() == [[True, False, True]]


def test_a_margin_asks_for_more_than_a_glimpse():
    walls = [rectangle(10, -50, 11, 50), rectangle(20, -50, 21, 50)]
    prisms = Prisms.of_outlines(walls, np.array([10.0, 18.1]))
    eye = np.array([[0.0, 0.0, 2.0]])
    assert (~np.isnan(seen_from(prisms, eye))).tolist() == [[True, True]]
    assert (~np.isnan(seen_from(prisms, eye, margin=0.2))).tolist() == [[True, False]]


def test_what_the_puzzles_say_is_seen_and_hidden():
    rng = np.random.default_rng(0)
    for make in PUZZLES:
        posed = make()
        prisms = prisms_of(posed.scene, "z")
        low, high = posed.cells.low[0], posed.cells.high[0]
        eyes = rng.uniform(low, high, (300, 3)) - prisms.origin
        eyes[::2, 2] = high[2] - prisms.origin[2]
        seen = ~np.isnan(seen_from(prisms, eyes, 90))
        names = {posed.scene.names[index] for index in np.flatnonzero(seen.any(axis=0))}
        assert posed.seen <= names, make.__name__
        assert not posed.hidden & names, make.__name__


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_prisms_of_a_scene_follow_its_axes_and_instances(up):
    first = "xyz".index(up)
    mesh = box((2.0, 3.0, 5.0))
    flat = TriangleMesh(np.roll(mesh.vertices, first - 2, axis=1), mesh.faces)
    mirror = np.roll(np.array([-1.0, 1.0, 1.0]), first - 2)
    places = [moved(*np.roll([10.0, 0.0, 1.0], first - 2)), moved(linear=np.diag(mirror))]
    prisms = prisms_of(scene_of([flat], [0, 0], places), up)
    assert prisms.upright.all()
    assert prisms.tops.tolist() == [6.0, 5.0]
    assert np.array_equal(prisms.origin, [-2.0, 0.0, 0.0])
    assert prisms.boxes.tolist() == [[12.0, 0.0, 14.0, 3.0], [0.0, 0.0, 2.0, 3.0]]
    for outline in np.split(prisms.edges, prisms.offsets[1:-1]):
        assert len(outline) == 4
        (ax, ay), (bx, by) = outline[:, 0].T, outline[:, 1].T
        assert np.sum(ax * by - ay * bx) == 12.0
    assert len(prisms.points) == 0


def outline_of(mesh):
    return flat_outline(mesh.vertices, mesh.faces)


def test_what_is_an_upright_prism():
    ell = joined(box((2.0, 1.0, 3.0)), box((1.0, 1.0, 3.0), (0.0, 1.0, 0.0)))
    assert len(outline_of(ell)) == 8  # where they touch, two edges lie one upon the other
    assert len(outline_of(box(without=(4,)))) == 4
    assert len(outline_of(box(without=(0, 1, 2, 3)))) == 4
    assert outline_of(box(without=(5,))) is None
    assert outline_of(joined(box(), box((1.0, 1.0, 2.0), (1.0, 0.0, 0.0)))) is None
    assert outline_of(joined(box(), box((1.0, 1.0, 1.0), (3.0, 0.0, 0.0)))) is not None
    skewed = box()
    leaning = TriangleMesh(
        skewed.vertices + skewed.vertices[:, [2]] * [0.1, 0.0, 0.0], skewed.faces
    )
    assert outline_of(leaning) is None
    twice = joined(box(), box())
    assert outline_of(twice) is None


def gabled(low, extent, ridge):
    """A house whose roof rises to a ridge along y."""
    mesh = box(extent, low)
    x, z = low[0] + 0.5 * extent[0], low[2] + extent[2] + ridge
    ends = [[x, low[1], z], [x, low[1] + extent[1], z]]
    roof = [[1, 5, 8], [3, 9, 7], [1, 8, 9], [1, 9, 3], [5, 7, 9], [5, 9, 8]]
    sides = [face for face in mesh.faces if (mesh.vertices[face, 2] == low[2]).any()]
    return TriangleMesh.from_soup(
        np.concatenate([mesh.vertices, ends]), np.concatenate([sides, roof])
    )


def test_a_gabled_house_hides_as_its_column_and_is_seen_by_its_ridge():
    house = gabled((20.0, -5.0, 0.0), (10.0, 10.0, 6.0), 4.0)
    scene = scene_of([house, box((4.0, 8.0, 11.5), (40.0, -4.0, 0.0))], [0, 1], [moved(), moved()])
    prisms = prisms_of(scene, "z")
    assert prisms.upright.tolist() == [False, True]
    assert prisms.tops.tolist() == [10.0, 11.5]
    assert set(prisms.point_of) == {0}
    assert prisms.points[:, 2].max() == 10.0
    # Over the eaves of the column, 10 m high at 20 m, the other house is out of view.
    eyes = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 9.5], [25.0, 0.0, 8.0], [25.0, 0.0, 30.0]])
    seen = ~np.isnan(seen_from(prisms, eyes - prisms.origin, 90))
    assert seen.tolist() == [[True, False], [True, True], [False, False], [True, True]]


def test_a_ridge_behind_a_wall_or_within_another_column_is_not_seen():
    house = gabled((20.0, -5.0, 0.0), (10.0, 10.0, 6.0), 4.0)
    around = box((30.0, 30.0, 12.0), (10.0, -15.0, 0.0))
    prisms = prisms_of(scene_of([house, around], [0, 1], [moved(), moved()]), "z")
    for height in (2.0, 11.0, 40.0):
        seen = ~np.isnan(seen_from(prisms, np.array([[-30.0, 1.0, height]]) - prisms.origin, 90))
        assert seen[0].tolist() == [False, True]


def test_the_answer_does_not_depend_on_where_the_city_is_and_which_way_it_is_turned():
    city = generated_city(4, seed=1)
    eyes = street_cells(city, 4, seed=2).high
    plain = seen_from(prisms_of(city, "z"), eyes - prisms_of(city, "z").origin, 100)
    far = np.eye(4)
    far[:3, :3], far[:3, 3] = turned("z", 37.0), [1_840_000.0, 5_170_000.0, 170.0]
    away = Scene(city.meshes, city.names, city.mesh_of, far @ city.transforms)
    prisms = prisms_of(away, "z")
    assert prisms.upright.all()
    places = eyes @ far[:3, :3].T + far[:3, 3] - prisms.origin
    assert (np.isnan(seen_from(prisms, places, 100)) != np.isnan(plain)).mean() < 0.01


def test_the_same_on_any_number_of_threads_and_told(monkeypatch):
    city = generated_city(3)
    prisms = prisms_of(city, "z")
    eyes = street_cells(city, 9).high - prisms.origin
    shares: list[float] = []
    answers = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        answers.append(seen_from(prisms, eyes, 60, tell=shares.append))
    assert np.array_equal(*answers, equal_nan=True)
    assert shares[-1] == 1.0


def test_nothing_is_seen_of_nothing():
    empty = Prisms.of_outlines([], np.empty(0))
    assert seen_from(empty, np.zeros((3, 3))).shape == (3, 0)


def test_boxes_of_any_size_are_prisms():
    boxes = np.array([[[0.0, 0.0, 0.0], [0.1, 0.3, 0.7]], [[1e-3, 5.0, 2.0], [0.2, 5.3, 2.1]]])
    assert prisms_of(scene_of_boxes(boxes, ["a", "b"]), "z").upright.all()
