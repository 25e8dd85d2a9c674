"""What hardly any viewer sees, against lines that are followed through the voxels one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from simplifier.errors import CancelledError
from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.solid import VoxelGrid
from simplifier.kernels.sight import (
    BLOCK,
    count_few,
    draw_voxels,
    list_voxels,
    picture_size,
    set_voxels,
)
from simplifier.voxel import sight
from simplifier.voxel.fill import fill
from simplifier.voxel.sight import few_see, fill_unseen, lines_of_sight, unseen
from simplifier.voxel.voxelize import voxelize
from tests import solids


def grid_of(inside):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0)


def box(size, wall=1):
    """A hollow box of voxels with free space around."""
    inside = np.zeros((size + 4,) * 3, dtype=np.bool_)
    inside[2:-2, 2:-2, 2:-2] = True
    inside[2 + wall : -2 - wall, 2 + wall : -2 - wall, 2 + wall : -2 - wall] = False
    return inside


def inner(size, wall=1):
    inside = np.zeros((size + 4,) * 3, dtype=np.bool_)
    inside[2 + wall : -2 - wall, 2 + wall : -2 - wall, 2 + wall : -2 - wall] = True
    return inside


def few_of(touched, free, tolerance, up=None):
    """As booleans."""
    return few_see(BitGrid.of(touched), BitGrid.of(free), tolerance, up).voxels


def unseen_of(touched, tolerance):
    return unseen(BitGrid.of(touched), tolerance).voxels


def listed(marked):
    return np.argwhere(marked).astype(np.int16, order="C")


def shares_seen(touched, up, half=0.5):
    """(nx, ny, nz): from which share of the directions a centre is seen, by following each line.

    A line is looked at where its pixel's centre is, as the pictures do; ``half`` a voxel's edge.
    """
    frames, senses = lines_of_sight(touched.shape, up)
    size = picture_size(touched.shape)
    seen = np.zeros(touched.shape)
    boxes = np.argwhere(touched)
    for frame, looks in zip(frames, senses, strict=True):
        axes, middle = frame[:9].reshape(3, 3), frame[9:]
        centres = boxes + 0.5 - middle
        places = (np.argwhere(~touched) + 0.5 - middle) @ axes.T
        own = places[:, 2:]
        # The lines through the pixels' centres against all cubes at once, slab by slab.
        starts = (np.floor(places[:, :2] + size / 2) + 0.5 - size / 2) @ axes[:2]
        slabs = (centres - starts[:, None])[..., None] + np.array([-half, half])
        steps = slabs / axes[2][:, None]
        met = steps.min(axis=3).max(axis=2) <= steps.max(axis=3).min(axis=2)
        depths = centres @ axes[2]
        seen[~touched] += looks[0] * ~(met & (depths < own)).any(axis=1)
        seen[~touched] += looks[1] * ~(met & (depths > own)).any(axis=1)
    return seen / senses.sum()


LARGER = 0.5 + 0.125 * 2.0**0.5
"""Half the edge of a voxel that holds all that its outline may be drawn too large: an eighth of a
pixel along both axes of the picture."""


@settings(max_examples=12)
@given(
    st.tuples(*3 * [st.integers(1, 5)]), st.floats(0.05, 0.6), st.integers(0, 99),
    st.sampled_from([None, 0, 1, 2]),
)  # fmt: skip
def test_random_voxels_are_seen_as_lines_that_are_followed_see_them(shape, density, seed, up):
    touched = np.random.default_rng(seed).random(shape) < density
    wanted, at_least = shares_seen(touched, up), shares_seen(touched, up, LARGER)
    for tolerance in (0.0, 0.1, 0.5, 0.9):
        found = few_of(touched, ~touched, tolerance, up)
        assert not (found & touched).any()
        assert not (~found & ~touched & (wanted <= tolerance)).any()
        assert not (found & (at_least > tolerance)).any()


def test_directions_are_spread_evenly_and_turn_into_one_another():
    frames, senses = lines_of_sight((4, 6, 8), None)
    assert senses.all()
    lines = frames[:, 6:9]
    both = np.concatenate([lines, -lines])
    near = np.sort(both @ both.T, axis=1)[:, -2]
    assert len(both) == 240
    assert 10.0 < np.degrees(np.arccos(near)).min() < np.degrees(np.arccos(near)).max() < 16.0
    turned = both[:, [1, 2, 0]] * [1.0, -1.0, 1.0]
    assert np.allclose(np.sort(both @ turned.T, axis=1)[:, -1], 1.0)
    axes = frames[:, :9].reshape(-1, 3, 3)
    assert np.allclose(axes @ axes.transpose(0, 2, 1), np.eye(3))
    assert np.array_equal(frames[:, 9:], np.tile([2.0, 3.0, 4.0], (120, 1)))


@pytest.mark.parametrize("count", [0, 1, 1023, 1024, 1025, 9000])
def test_candidates_are_judged_each_by_itself(count):
    """However many there are, and so wherever their blocks end."""
    touched = box(20)
    touched[4:9, 10, 2:4] = False  # a hole, so that some of the inside is seen
    first = np.zeros(touched.shape, dtype=np.bool_)
    first.ravel()[np.flatnonzero(~touched)[:count]] = True
    among_all = few_of(touched, ~touched, 0.1)
    assert np.array_equal(few_of(touched, first, 0.1), among_all & first)
    assert 1000 < np.count_nonzero(among_all) < np.count_nonzero(~touched) - 1000


def test_from_above_each_line_is_looked_along_downwards():
    frames, senses = lines_of_sight((4, 4, 4), 1)
    down = np.where(senses[:, 0] == 1, frames[:, 7], -frames[:, 7])
    assert (senses.sum(axis=1) == 1).all()
    assert (down < 0.0).all()


def test_a_surface_has_no_pinholes():
    """Each pixel whose centre lies within the shadow of a box of voxels shows one of them."""
    touched = box(9)
    frames, _ = lines_of_sight(touched.shape, None)
    size = picture_size(touched.shape)
    depths = np.empty((len(frames), size, size, 2), dtype=np.float32)
    draw_voxels(listed(touched).T.copy(), frames, 0, len(frames), depths)
    near, far = np.moveaxis(depths, -1, 0)
    corners = np.array(np.meshgrid(*3 * [[-4.5, 4.5]])).reshape(3, -1).T
    places = np.stack(np.meshgrid(*2 * [np.arange(size) + 0.5 - size / 2], indexing="ij"), axis=-1)
    for line, frame in enumerate(frames):
        shadow = ConvexHull(corners @ frame[:6].reshape(2, 3).T).equations
        within = (places @ shadow[:, :2].T + shadow[:, 2] < -1e-9).all(axis=-1)
        assert np.isfinite(near[line][within]).all()
        assert (near[line][within] <= far[line][within]).all()
        away = (places @ shadow[:, :2].T + shadow[:, 2] > 0.2).any(axis=-1)
        assert np.isinf(near[line][away]).all()


@pytest.mark.parametrize("count", [0, 1, 40])
def test_few_candidates_are_seen_from_as_many_sides_as_whole_pictures_tell(count):
    touched, generator = box(20), np.random.default_rng(5)
    touched[4:9, 10, 2:4] = False
    frames, senses = lines_of_sight(touched.shape, 1)
    senses[::7] = 1
    size = picture_size(touched.shape)
    places = generator.permutation(listed(~touched))[:count]
    voxels = listed(touched).T.copy()
    whole = np.empty((len(frames), size, size, 2), dtype=np.float32)
    draw_voxels(voxels, frames, 0, len(frames), whole)
    found = np.full((len(frames), count), 9, dtype=np.uint8)
    middle = len(frames) // 3
    for begin, end in ((middle, len(frames)), (0, middle)):
        count_few(voxels, places.T.copy(), frames, senses, size, begin, end, found)
    for line, frame in enumerate(frames):
        axes, centre = frame[:9].reshape(3, 3), frame[9:]
        rows, columns, depths = axes @ (places + 0.5 - centre).T + [[size / 2], [size / 2], [0.0]]
        near, far = whole[line, rows.astype(int), columns.astype(int)].T
        along, against = senses[line]
        expected = along * (near >= depths) + against * (far <= depths)
        np.testing.assert_array_equal(found[line], expected)
    assert count == 0 or found.max() > 0


def test_nothing_is_drawn_when_all_are_seen(monkeypatch):
    drawn = []
    monkeypatch.setattr(sight, "draw_voxels", lambda *arguments: drawn.append(arguments))
    touched = np.zeros((9, 9, 9), dtype=np.bool_)
    assert not few_of(touched, touched, 0.1).any()
    assert drawn == []


@pytest.mark.parametrize("size", [6, 20, 99])
def test_a_closed_box_is_filled_as_the_flood_fills_it(size):
    touched = grid_of(box(size))
    flooded = fill(touched)
    assert np.array_equal(fill_unseen(touched, flooded, 0.1).inside, flooded.inside)
    nothing_known = fill_unseen(touched, touched, 0.1)
    assert np.array_equal(nothing_known.inside, flooded.inside)


@pytest.mark.parametrize("size", [20, 99])
def test_a_box_with_a_hole_keeps_its_inside(size):
    """The flood finds nothing inside; from nearly everywhere the box looks closed."""
    touched = box(size)
    middle = touched.shape[0] // 2
    width = size // 10
    touched[:3, middle - width : middle + width, middle - width : middle + width] = False
    grid = grid_of(touched)
    assert fill(grid).count == grid.count
    found = fill_unseen(grid, fill(grid), 0.1).inside
    missing = inner(size) & ~found
    assert missing.sum() < 0.01 * inner(size).sum()
    assert not (found & ~(inner(size) | touched | box(size))).any()


def test_a_box_without_a_lid_is_inside_where_its_opening_looks_small():
    """Down its middle the opening, a square, takes up so much of all that one can look at."""
    touched = box(20)
    touched[:, -3:, :] = False
    grid = grid_of(touched)
    found = fill_unseen(grid, fill(grid), 0.1).inside
    half, rim = 9.0, touched.shape[1] - 3
    depths = rim - (np.arange(3, rim) + 0.5)
    share = np.arcsin(half**2 / (half**2 + depths**2)) / np.pi
    middle = found[12, 3:rim, 12]
    assert middle[share < 0.085].all()
    assert not middle[share > 0.125].any()
    assert middle.any()
    # Half of all directions lead down, and the opening is among them.
    above = fill_unseen(grid, fill(grid), 0.1, up=1).inside
    assert not above[12, 3:rim, 12][share > 0.0625].any()


@settings(max_examples=25)
@given(st.tuples(*3 * [st.integers(1, 12)]), st.floats(0.02, 0.5), st.integers(0, 999))
def test_it_grows_with_the_tolerance_and_keeps_what_is_closed(shape, density, seed):
    touched = grid_of(np.random.default_rng(seed).random(shape) < density)
    flooded = fill(touched)
    before = flooded.inside
    for tolerance in (0.0, 0.02, 0.1, 0.4, 1.0):
        found = fill_unseen(touched, flooded, tolerance).inside
        assert not (before & ~found).any()
        before = found
    assert before.all()


@settings(max_examples=15)
@given(
    st.tuples(*3 * [st.integers(2, 14)]), st.integers(0, 999), st.permutations(range(3)),
    st.tuples(*3 * [st.booleans()]),
)  # fmt: skip
def test_it_follows_quarter_turns_and_mirrors(shape, seed, order, mirrored):
    touched = np.random.default_rng(seed).random(shape) < 0.15
    flips = tuple(slice(None, None, -1) if one else slice(None) for one in mirrored)
    turned = np.ascontiguousarray(touched.transpose(order)[flips])
    found = unseen_of(touched, 0.1)
    assert np.array_equal(unseen_of(turned, 0.1), found.transpose(order)[flips])


@settings(max_examples=15)
@given(st.integers(0, 999), st.integers(8, 24))
def test_a_convex_closed_mesh_has_no_more_than_the_flood_finds(seed, resolution):
    points = np.random.default_rng(seed).normal(size=(40, 3)) * [1.0, 0.7, 0.4]
    touched = voxelize(TriangleMesh.from_soup(points, ConvexHull(points).simplices), resolution)
    flooded = fill(touched)
    assert np.array_equal(fill_unseen(touched, flooded, 0.1).inside, flooded.inside)


def test_finer_grids_find_what_coarse_ones_do():
    """Past 96 voxels cells are looked at first; the bowl of an open sphere stays as it is."""
    ball = solids.sphere(1.0, rings=48)
    open_ball = TriangleMesh(
        ball.vertices, ball.faces[ball.vertices[ball.faces].mean(1)[:, 1] < 0.9]
    )
    shares = []
    for resolution in (48, 96, 97, 128):
        touched = voxelize(open_ball, resolution)
        shares.append(fill_unseen(touched, fill(touched), 0.1).count / touched.inside.size)
    assert max(shares) - min(shares) < 0.06
    assert min(shares) > 0.45


@settings(max_examples=50)
@given(
    st.tuples(*2 * [st.integers(1, 9)], st.integers(1, 200)), st.floats(0.0, 1.0),
    st.integers(0, 999),
)  # fmt: skip
def test_voxels_are_listed_and_set_as_they_are(shape, density, seed):
    marked = np.random.default_rng(seed).random(shape) < density
    grid, layers = BitGrid.of(marked), np.count_nonzero(marked, axis=(1, 2))
    firsts = np.concatenate([[0], np.cumsum(layers)])
    places = np.full((firsts[-1], 3), -1, dtype=np.int16)
    for begin, end in ((len(marked) // 2, len(marked)), (0, len(marked) // 2)):
        list_voxels(grid.words, firsts, begin, end, places)
    assert np.array_equal(places, np.argwhere(marked))
    again = BitGrid.empty(shape)
    live = np.full(-(-len(places) // BLOCK), BLOCK)
    live[-1:] -= BLOCK * len(live) - len(places)
    set_voxels(places, live, again.words)
    assert np.array_equal(again.voxels, marked)


def test_what_was_taken_out_of_its_block_is_not_set():
    places = np.zeros((BLOCK + 2, 3), dtype=np.int16)
    places[:, 2] = np.arange(BLOCK + 2)
    hidden = BitGrid.empty((1, 1, BLOCK + 2))
    set_voxels(places, np.array([3, 1]), hidden.words)
    assert np.flatnonzero(hidden.voxels).tolist() == [0, 1, 2, BLOCK]


@pytest.mark.parametrize("size", [20, 99])
def test_it_tells_how_far_it_is_and_ends_when_it_is_told_to(size):
    touched, shares = grid_of(box(size)), []
    fill_unseen(touched, touched, 0.1, tell=shares.append)
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] <= 1.0

    def stop(share):
        raise CancelledError(f"at {share:g}")

    with pytest.raises(CancelledError, match=f"at {shares[0]:g}"):
        fill_unseen(touched, touched, 0.1, tell=stop)
