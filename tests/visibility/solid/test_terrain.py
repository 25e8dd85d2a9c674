"""Tiles of a terrain and their heights: bounds whichever way squares are split."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.elevation import Elevation
from simplifier.kernels.terrain import square_bounds
from simplifier.visibility.solid.terrain import Terrain, terrain_field


def terrain_of(heights, spacing=(1.0, 1.0), tile=2, origin=None):
    heights = np.array(heights, dtype=np.float64)
    if origin is None:
        origin = (0.0, (len(heights) - 1) * spacing[1])
    return Terrain.of(Elevation(heights, spacing, origin), tile)


def field_of(terrain, cell, margin=0.0):
    upright = UprightScene.of(terrain.scene, "z")
    plan = np.array([-np.full(2, margin), upright.extent[:2] + margin])
    return upright, terrain_field(terrain, upright, cell, plan)


def surface(terrain, x, y, split):
    """The heights at places from the south-west post, in posts; split 0 from the first post."""
    heights = terrain.heights
    c, r = (
        np.minimum(np.asarray(place).astype(int), length - 2)
        for place, length in zip((x, y), heights.shape, strict=True)
    )
    u, v = x - c, y - r
    h00, h10, h01, h11 = (heights[c + i, r + j] for j in (0, 1) for i in (0, 1))
    near, far = h00 + (h10 - h00) * u + (h01 - h00) * v, h11 - (h11 - h01) * (1 - u)
    if split == 0:
        right = h00 + (h10 - h00) * u + (h11 - h10) * v
        return np.where(u >= v, right, h00 + (h11 - h01) * u + (h01 - h00) * v)
    return np.where(u + v <= 1.0, near, far - (h11 - h10) * (1 - v))


HEIGHTS = arrays.arrays(
    np.float64, st.tuples(st.integers(2, 6), st.integers(2, 6)),
    elements=st.integers(-9, 9).map(float),
)  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(HEIGHTS, st.sampled_from([0.3, 0.5, 1.0, 1.7]))
def test_heights_are_the_least_and_the_greatest_of_both_surfaces(heights, cell):
    terrain = terrain_of(heights, (1.0, 1.5))
    upright, field = field_of(terrain, cell)
    end = (np.array(terrain.heights.shape) - 1) * [1.0, 1.5]
    for i, j in np.ndindex(field.shape):
        corner = field.low + cell * np.array([i, j])
        if (corner + cell < 0.0).any() or (corner > end).any():
            assert field.tops[i, j] == -np.inf
            continue
        steps = np.linspace(0.0, cell, 13)
        x, y = np.meshgrid(
            np.clip(corner[0] + steps, 0.0, end[0]), np.clip(corner[1] + steps, 0.0, end[1]) / 1.5
        )
        both = np.array([surface(terrain, x, y, split) for split in (0, 1)]) - upright.origin[2]
        least, most = both.min(), both.max()
        if np.isfinite(field.inner[i, j]):
            assert field.inner[i, j] <= least + 1e-5
            assert field.inner[i, j] >= least - cell * 4.0
        assert most - 1e-5 <= field.tops[i, j] <= most + cell * 4.0


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.integers(-9, 9).map(float), min_size=4, max_size=4),
    st.lists(st.integers(0, 16).map(lambda n: n / 16), min_size=4, max_size=4),
)
def test_bounds_of_a_square_are_reached(posts, box):
    u0, u1, v0, v1 = (*sorted(box[:2]), *sorted(box[2:]))
    terrain = terrain_of([[posts[2], posts[3]], [posts[0], posts[1]]])
    u, v = np.meshgrid(
        *(np.arange(low, high + 1 / 32, 1 / 16) for low, high in ((u0, u1), (v0, v1)))
    )
    both = np.array([surface(terrain, u, v, split) for split in (0, 1)])
    low, high = square_bounds(*posts, u0, u1, v0, v1)
    # Corners of the box are sixteenths, so that diagonals leave it at these.
    assert low == pytest.approx(both.min(), abs=1e-12)
    assert high == pytest.approx(both.max(), abs=1e-12)


def test_beyond_the_terrain_it_is_solid_where_no_viewer_is():
    terrain = terrain_of([[0.0, 5.0], [0.0, 0.0]])
    _, inside = field_of(terrain, 0.25)
    _, outside = field_of(terrain, 0.25, 0.1)
    assert inside.beyond == pytest.approx(5.01, rel=1e-6)
    assert inside.inner[-1, -1] == inside.inner[-1, 3] == inside.beyond
    assert outside.beyond == outside.inner[0, 0] == -np.inf
    # The pixels at the border are bounded by what they have of the terrain.
    assert inside.inner.min() == np.float32(0.01)


@settings(max_examples=60, deadline=None)
@given(HEIGHTS, st.integers(1, 4))
def test_over_whole_squares_the_bounds_are_the_posts(heights, tile):
    terrain = terrain_of(heights, tile=tile)
    upright, field = field_of(terrain, 0.5)
    posts = terrain.heights - upright.origin[2]
    for c, r in np.ndindex(*terrain.known.shape):
        own = posts[c : c + 2, r : r + 2]
        i, j = np.round((np.array([c, r]) - field.low) / 0.5).astype(int)
        some = slice(i, i + 2), slice(j, j + 2)
        assert field.tops[some].max() >= np.float32(own.max())
        assert (field.inner[some] <= own.max()).all()
        # A pixel that touches no other square is bounded by its own posts.
        column, row = c // tile, (terrain.known.shape[1] - 1 - r) // tile
        number = terrain.numbers[column, row]
        place = i * field.shape[1] + j
        here = slice(field.starts[place], field.starts[place + 1])
        assert number in field.objects[here]


def test_a_plane_is_met_exactly():
    x, y = np.meshgrid(np.arange(7.0), np.arange(5.0))
    terrain = terrain_of(3.0 * x - 2.0 * y, tile=3)
    upright, field = field_of(terrain, 0.25)
    solid = np.zeros(field.shape, bool)
    solid[5:-5, 5:-5] = True
    i, j = np.argwhere(solid).T
    centre = 3.0 * ((i + 0.5) * 0.25 + field.low[0]) + 2.0 * ((j + 0.5) * 0.25 + field.low[1])
    base = centre - 8.0 - upright.origin[2]
    half = 0.125 * 5.0
    assert np.allclose(field.inner[solid], base - half, atol=1e-5)
    assert np.allclose(field.tops[solid], base + half, atol=1e-5)


def test_each_pixel_knows_its_tiles_and_how_high_they_are_there():
    heights = np.zeros((5, 5))
    heights[1, 3] = 8.0
    terrain = terrain_of(heights, tile=2)
    assert terrain.scene.names == ("tile_0_0", "tile_0_1", "tile_1_0", "tile_1_1")
    upright, field = field_of(terrain, 0.5)

    def tiles_at(x, y):
        i, j = np.floor((np.array([x, y]) - field.low) / 0.5).astype(int)
        here = slice(*field.starts[[i * field.shape[1] + j, i * field.shape[1] + j + 1]])
        tops = field.object_tops[here] + upright.origin[2]
        return {
            terrain.scene.names[one]: round(float(top), 3)
            for one, top in zip(field.objects[here], tops, strict=True)
        }

    assert tiles_at(0.7, 0.7) == {"tile_1_0": 0.0}
    assert tiles_at(3.2, 3.2) == {"tile_0_1": 8.0}
    # Half way to the post, along the diagonal that is the higher one.
    assert tiles_at(2.2, 2.2) == {
        "tile_0_0": 0.0, "tile_0_1": 4.0, "tile_1_0": 0.0, "tile_1_1": 0.0
    }  # fmt: skip
    assert set(tiles_at(1.7, 3.2)) == {"tile_0_0", "tile_0_1"}  # it ends where the other begins
    assert set(tiles_at(1.3, 3.2)) == {"tile_0_0"}


def test_missing_samples_hide_nothing_and_their_tiles_are_told():
    heights = np.zeros((7, 7))
    heights[1, 1] = np.nan
    heights[4:, 4:] = np.nan
    terrain = terrain_of(heights, tile=3)
    assert terrain.scene.names == ("tile_0_0", "tile_0_1", "tile_1_0")
    assert terrain.holed.tolist() == [True, False, False]
    (told,) = terrain.scene.warnings
    assert told.startswith("10 of 49 posts have no height")
    assert "1 tile with such posts always visible" in told
    assert "1 without any surface left out" in told
    assert np.isfinite(terrain.heights).all()
    _, field = field_of(terrain, 0.5)
    assert np.array_equal(field.holed, terrain.holed)
    i, j = np.floor((np.array([0.6, 5.6]) - field.low) / 0.5).astype(int)
    assert field.inner[i, j] == -np.inf
    assert np.isfinite(field.inner[i + 5, j - 3])
    missing = np.zeros(field.shape)
    missing[1:13, 1:13] = np.kron(~terrain.known, np.ones((2, 2)))
    assert np.array_equal(np.isneginf(field.inner), ndimage.maximum_filter(missing, 3) > 0.0)


def test_tiles_are_closed_at_the_sides_and_lie_where_the_posts_are():
    random = np.random.default_rng(3)
    heights = random.uniform(100.0, 130.0, (8, 6))
    heights[3, 2] = np.nan
    terrain = terrain_of(heights, (30.0, 20.0), 3, (4e5, 5e6))
    whole = np.concatenate([mesh.vertices for mesh in terrain.scene.meshes])
    low, high = whole.min(axis=0), whole.max(axis=0)
    assert low[:2].tolist() == [4e5, 5e6 - 140.0]
    assert high[:2].tolist() == [4e5 + 150.0, 5e6]
    for mesh, holed in zip(terrain.scene.meshes, terrain.holed, strict=True):
        a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        assert (np.linalg.norm(normals, axis=1) > 0.0).all()
        assert (normals[:, 2] >= 0.0).all()
        surface_area = 0.5 * normals[:, 2].sum() / 600.0
        assert surface_area == pytest.approx(round(surface_area))
        assert holed or round(surface_area) in (9, 6, 3, 2)
    # Every border of the surface has a side: the only open edges are those at the base.
    points, places = np.unique(whole, axis=0, return_inverse=True)
    places, begin, faces = places.reshape(-1), 0, []
    for mesh in terrain.scene.meshes:
        faces.append(places[begin + mesh.faces])
        begin += len(mesh.vertices)
    faces = np.concatenate(faces)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    each, count = np.unique(edges, axis=0, return_counts=True)
    assert (points[each[count == 1]][:, :, 2] == low[2]).all()
