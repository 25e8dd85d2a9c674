"""Candidates: their maps against an explicit projection, their pictures and their areas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon as ShapelyPolygon

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.selection.candidates import Candidates, score
from simplifier.selection.measure import bit_measure
from tests.pictures import sphere_projections
from tests.selection.scenes import projections, random_candidates, random_chains

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(1, 8))
def test_maps_equal_plane_to_space_to_pixels(seed, count):
    chains, maps = random_chains(seed, count), projections(9)
    candidates = Candidates.from_chains(chains, maps)
    for polygon, chain in enumerate(chains):
        points = chain.plane.to_space(chain.ring)
        for view, projection in enumerate(maps):
            expected = points @ projection[:, :3].T + projection[:, 3]
            m = candidates.maps[polygon, view]
            x = m[0] * chain.ring[:, 0] + m[1] * chain.ring[:, 1] + m[2]
            y = m[3] * chain.ring[:, 0] + m[4] * chain.ring[:, 1] + m[5]
            assert np.allclose(np.stack([x, y], axis=1), expected, atol=1e-10)


def test_polygons_lie_end_to_end():
    chains = random_chains(5, 7)
    candidates = Candidates.from_chains(chains, projections(3))
    assert len(candidates) == 7
    assert candidates.views == 3
    assert candidates.offsets.tolist() == np.cumsum([0, *(len(c.ring) for c in chains)]).tolist()
    assert np.array_equal(candidates.points, np.concatenate([c.ring for c in chains]))
    assert candidates.triangles.tolist() == [chain.triangles for chain in chains]


def test_dtypes_are_those_that_kernels_are_compiled_for():
    for candidates in (random_candidates(1, 3), Candidates.from_chains([], projections(3))):
        arrays = (candidates.points, candidates.lowest, candidates.offsets, candidates.maps)
        assert [a.dtype.name for a in arrays] == ["float64", "int32", "int64", "float64"]
        assert all(array.flags.c_contiguous for array in arrays)
        assert candidates.triangles.dtype == np.int32


def test_no_candidates():
    candidates = Candidates.from_chains([], projections(5))
    assert len(candidates) == 0
    assert candidates.views == 5
    assert score(candidates.nothing()) == 0
    none = np.empty(0, dtype=np.int32)
    assert candidates.scores(none, none, candidates.nothing()).shape == (0,)


def test_scores_add_one_polygon_at_a_time(monkeypatch):
    candidates = random_candidates(3, 40)
    base = candidates.draw(7, 2)
    polygons = np.arange(40, dtype=np.int32)
    levels = np.minimum(candidates.triangles, 3).astype(np.int32)
    expected = [score(base | candidates.draw(int(p), int(levels[p]))) for p in polygons]
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        assert candidates.scores(polygons, levels, base).tolist() == expected


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_areas_by_level(seed):
    chains = random_chains(seed, 3)
    candidates = Candidates.from_chains(chains, projections(2))
    for polygon, chain in enumerate(chains):
        areas = candidates.areas(polygon)
        levels = range(1, chain.triangles + 1)
        assert areas[0] == 0.0
        assert areas[1:] == pytest.approx([ShapelyPolygon(chain.at(k)).area for k in levels])
        assert (np.diff(areas) >= -1e-9).all()


def test_a_score_is_twice_the_bit_measure_summed_over_views():
    candidates = random_candidates(9, 2)
    images = candidates.draw(0, 2) | candidates.draw(1, 1)
    assert score(images) == 2 * sum(bit_measure(image) for image in images)


@settings(max_examples=20, deadline=None)
@given(seeds, st.floats(1e-3, 1e3))
def test_search_projections_show_the_sphere_with_a_frame(seed, radius):
    """The rim one pixel within the image, the centre in the middle, u along columns, v rows."""
    generator = np.random.default_rng(seed)
    centre = generator.normal(0.0, 10.0 * radius, 3)
    axes = image_axes(hemisphere_directions(7))
    maps = sphere_projections(axes, centre, radius)
    points = generator.normal(size=(50, 3))
    points = centre + radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    for frame, projection in zip(axes, maps, strict=True):
        u, v = frame[:2]
        for rim, pixel in ((u, (63, 32)), (-u, (1, 32)), (v, (32, 63)), (-v, (32, 1))):
            shown = projection[:, :3] @ (centre + radius * rim) + projection[:, 3]
            assert shown == pytest.approx(pixel, abs=1e-6)
        shown = points @ projection[:, :3].T + projection[:, 3]
        assert (np.hypot(*(shown - 32.0).T) < 31.0 + 1e-6).all()


def test_the_scene_fits_into_its_pictures():
    candidates = random_candidates(2, 30)
    for polygon in range(30):
        images = candidates.draw(polygon, int(candidates.triangles[polygon]))
        assert images.any()
