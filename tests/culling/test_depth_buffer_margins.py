"""What is called hidden lies behind an occluder by the margin, to the pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.errors import MeshError, OptionError
from simplifier.geometry.camera import Camera
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, PAST, STALE, TILE

ROWS, COLUMNS = 19, 26  # no whole number of tiles
AHEAD = Camera(np.zeros(3), np.diag([-1.0, 1.0, 1.0]), 90.0, 0.1)
FOCAL = ROWS / 2.0


def world(x, y, depth):
    """The point of that depth that the camera shows at a place of the screen, in pixels."""
    return np.array([(0.5 * COLUMNS - x), (0.5 * ROWS - y), FOCAL]) * depth / FOCAL


def flat_box(left, right, top, bottom, depth):
    """A box without thickness, so that its outline is its rectangle."""
    corners = np.stack([world(left, top, depth), world(right, bottom, depth)])
    return np.stack([corners.min(axis=0), corners.max(axis=0)])[None]


def verdict(buffer, box):
    """Of a buffer whose pixels were set by hand."""
    buffer.tiles[FARTHEST], buffer.tiles[STALE] = 0.0, 1.0
    return Verdict(buffer.test(box, AHEAD)[0])


def settled_margin(buffer, left, right, top, bottom):
    """The least margin that holds the screen error of all tiles that the rectangle then meets."""
    margin = buffer.margin
    while True:
        rows = [int(np.clip(y, 0, ROWS - 1)) // TILE for y in (top - margin, bottom + margin)]
        columns = [int(np.clip(x, 0, COLUMNS - 1)) // TILE for x in (left - margin, right + margin)]
        met = buffer.tiles[ERROR, rows[0] : rows[1] + 1, columns[0] : columns[1] + 1]
        needed = buffer.margin + float(met.max())
        if needed <= margin:
            return margin
        margin = needed


@pytest.mark.parametrize("coverage", ["centre", "inner"])
@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_one_open_pixel_that_the_grown_rectangle_meets_is_enough(coverage, seed, blurred):
    rng = np.random.default_rng(seed)
    left, top = rng.uniform(-3.0, [COLUMNS - 1.0, ROWS - 1.0])
    across, down = rng.uniform(0.05, 6.0, 2)
    right, bottom = max(left + across, 0.5), max(top + down, 0.5)  # some of it on the screen
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    if blurred:
        buffer.tiles[ERROR] = rng.choice([0.0, 0.6, 1.7], buffer.tiles[ERROR].shape)
    depth = rng.choice([0.4, 2.0])
    box = flat_box(left, right, top, bottom, depth)
    margin = settled_margin(buffer, left, right, top, bottom)
    reach = int(margin) + 2
    drawn = buffer.depth[:ROWS, :COLUMNS]
    nearer = 2.0 / depth
    drawn[:] = nearer
    assert verdict(buffer, box) == Verdict.HIDDEN
    for row in range(max(int(top) - reach, 0), min(int(bottom) + reach + 1, ROWS)):
        for column in range(max(int(left) - reach, 0), min(int(right) + reach + 1, COLUMNS)):
            gaps = [column - (right + margin), left - margin - (column + 1)]
            gaps += [row - (bottom + margin), top - margin - (row + 1)]
            if min(abs(gap) for gap in gaps) < 1e-4:
                continue
            drawn[row, column] = 0.9 / depth
            expected = Verdict.HIDDEN if max(gaps) > 0.0 else Verdict.VISIBLE
            assert verdict(buffer, box) == expected
            drawn[row, column] = nearer


@pytest.mark.parametrize("steps", [1, 4, 6])
def test_an_error_that_a_grown_rectangle_meets_makes_it_grow_again(steps):
    """One tile after the other, each of which asks for the next; then one more pixel is open."""
    buffer = DepthBuffer(TILE, 20 * TILE)
    middle = 10 * TILE
    for away in range(1, steps):
        buffer.tiles[ERROR, 0, 9 + away] = TILE * away
    camera = Camera(np.zeros(3), AHEAD.axes, 90.0, 0.1)
    place = np.array([-0.4, 0.0, 1.0]) / (TILE / 2.0)  # in the first of those tiles
    box = np.stack([2.0 * place, 2.0 * place])[None]
    box[:, :, 2] = 2.0
    reach = TILE * (steps - 1)
    for column, expected in (
        (middle + reach + 2, Verdict.HIDDEN),
        (middle + reach, Verdict.VISIBLE),
    ):
        buffer.tiles[FARTHEST], buffer.tiles[STALE] = 0.0, 1.0
        buffer.depth[:, :] = 1.0
        buffer.depth[:, column] = 0.0
        assert buffer.test(box, camera)[0] == expected


@pytest.mark.parametrize("coverage", ["centre", "inner"])
def test_nearer_is_nearer_and_not_as_near(coverage):
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    box = flat_box(5.0, 9.0, 4.0, 7.0, 2.0)
    for share, expected in (
        (1e-5, Verdict.HIDDEN),
        (0.0, Verdict.VISIBLE),
        (-1e-5, Verdict.VISIBLE),
    ):
        buffer.depth[:ROWS, :COLUMNS] = 1.0
        buffer.depth[5, 6] = 0.5 * (1.0 + share)
        assert verdict(buffer, box) == expected


def half_plane(angle, offset, depth):
    """A triangle whose one long edge passes the screen's middle by so many pixels; its inside."""
    normal = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-normal[1], normal[0]])
    on_edge = np.array([COLUMNS, ROWS]) / 2.0 + offset * normal
    places = [on_edge + 900.0 * along, on_edge - 900.0 * along, on_edge - 900.0 * normal]
    return np.array([[world(*place, depth) for place in places]]), on_edge, normal, along


@pytest.mark.parametrize("coverage", ["centre", "inner"])
@settings(max_examples=40)
@given(
    st.floats(0.0, 6.28), st.floats(-4.0, 4.0), st.floats(-6.0, 6.0), st.floats(1e-3, 1.0),
    st.sampled_from([0.0, 0.1, 0.4]),
)  # fmt: skip
def test_nothing_past_an_edge_is_hidden_wherever_within_its_error_the_edge_is(
    coverage, angle, offset, along_edge, past, error
):
    triangle, on_edge, normal, along = half_plane(angle, offset, 5.0)
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    buffer.draw(triangle, AHEAD, error)
    blur = error * FOCAL / 5.0
    for away, hidden in ((past - blur, False), (-2.5 - blur, True)):
        x, y = on_edge + away * normal + along_edge * along
        box = flat_box(x - 1e-5, x + 1e-5, y - 1e-5, y + 1e-5, 6.0)
        assert (buffer.test(box, AHEAD)[0] == Verdict.HIDDEN) == hidden


@pytest.mark.parametrize("coverage", ["centre", "inner"])
@pytest.mark.parametrize("error", [0.0, 0.3, 4.0])
def test_an_error_moves_an_occluder_away_by_as_much(coverage, error):
    triangle, *_ = half_plane(0.3, 400.0, 5.0)
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    buffer.draw(triangle, AHEAD, error)
    for depth, hidden in ((5.0 + error - 1e-3, False), (5.0 + error + 1e-3, True)):
        box = flat_box(12.9, 13.1, 9.4, 9.6, depth)
        assert (buffer.test(box, AHEAD)[0] == Verdict.HIDDEN) == hidden


def test_what_is_past_the_screen_is_nearer_than_all_whatever_was_drawn():
    """So it stands in nobody's way, from the first box on."""
    buffer = DepthBuffer(ROWS, COLUMNS)
    assert buffer.depth.shape == (24, 32)  # whole tiles, and no more
    assert buffer.tiles.shape == (3, 3, 4)
    past = np.ones(buffer.depth.shape, dtype=bool)
    past[:ROWS, :COLUMNS] = False
    triangle, *_ = half_plane(0.3, 400.0, 5.0)
    for _ in range(2):
        assert (buffer.depth[past] == PAST).all()
        assert (buffer.depth[~past] == 0.0).all()
        buffer.draw(triangle, AHEAD)
        assert (buffer.depth[past] == PAST).all()
        buffer.clear()


@pytest.mark.parametrize("coverage", ["centre", "inner"])
def test_meshes_without_faces_draw_nothing_and_those_of_another_shape_are_refused(coverage):
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    vertices = np.array([world(2.0, 2.0, 3.0), world(20.0, 2.0, 3.0), world(2.0, 17.0, 3.0)])
    for count in (0, 3):
        buffer.draw_mesh(vertices[:count], np.empty((0, 3), dtype=np.int32), AHEAD)
    assert not buffer.tiles.any()
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    for points, indices in (
        (vertices, faces[..., None]), (vertices[..., None], faces), (vertices, faces - 1),
        (vertices, faces + 1), (vertices[:, :2], faces), (vertices, faces[:, :2]),
    ):  # fmt: skip
        with pytest.raises(MeshError):
            buffer.draw_mesh(points, indices, AHEAD)
    buffer.draw_mesh(vertices, faces, AHEAD)
    assert buffer.tiles[STALE].any()


@pytest.mark.parametrize("shape", [(1, 3, 2), (1, 2, 3), (3, 3), (1, 1, 3, 3)])
def test_triangles_of_another_shape_and_coverages_of_another_name_are_refused(shape):
    with pytest.raises(MeshError, match="shape"):
        DepthBuffer(ROWS, COLUMNS).draw(np.zeros(shape), AHEAD)
    with pytest.raises(OptionError, match="coverage"):
        DepthBuffer(ROWS, COLUMNS, "outer")
