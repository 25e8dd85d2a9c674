"""Where an occluder fails to cover a mesh, against a ray a pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import image_axes, random_directions
from simplifier.kernels.loss import count_losses
from tests.kernels.test_front import depths_along_rays, soup

CELLS = 5


def projections_of(directions, image):
    """Those of a picture across the unit sphere."""
    made = np.zeros((len(directions), 3, 4))
    made[:, :, :3] = image_axes(directions)
    made[:, :2] *= image / 2.0
    made[:, :2, 3] = image / 2.0
    return made


def counted_by_rays(mesh, occluder, projections, image):
    """As :func:`count_losses`, and the pixels whose ray is in doubt, to be added or not."""
    counts, doubtful = np.zeros((2, CELLS, CELLS, CELLS), dtype=np.int64), 0
    for projection in projections:
        own, other = (
            corners @ projection[:, :3].T + projection[:, 3] for corners in (mesh, occluder)
        )
        (depth, doubt), (cover, unsure) = (depths_along_rays(one, image) for one in (own, other))
        doubtful += int((doubt | unsure).sum())
        for row, column in np.argwhere(np.isfinite(depth)):
            seen = np.array([column + 0.5, row + 0.5, depth[row, column]])
            point = np.linalg.solve(projection[:, :3], seen - projection[:, 3])
            place = tuple(np.clip(((point + 1.0) / 2.0 * CELLS).astype(int), 0, CELLS - 1))
            counts[0][place] += 1
            counts[1][place] += not np.isfinite(cover[row, column])
    return counts, doubtful


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 8), st.integers(0, 4), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_random_soups(triangles, others, image, seed):
    random = np.random.default_rng(seed)
    mesh, occluder = (random.uniform(-0.57, 0.57, (n, 3, 3)) for n in (triangles, others))
    projections = projections_of(random_directions(3, seed), image)
    expected, doubtful = counted_by_rays(mesh, occluder, projections, image)
    counts = count_losses(soup(mesh), soup(occluder), projections, image, CELLS)
    # A point on the edge of a cell may fall to either side.
    assert np.abs(counts - expected).sum() <= 4 * doubtful + 2
    assert (counts[1] <= counts[0]).all()


@pytest.mark.parametrize("threads", ["1", "3"])
def test_the_same_on_any_number_of_threads(threads, monkeypatch):
    random = np.random.default_rng(3)
    mesh, occluder = (soup(random.uniform(-0.57, 0.57, (9, 3, 3))) for _ in range(2))
    projections = projections_of(random_directions(9, 1), 32)
    whole = count_losses(mesh, occluder, projections, 32, CELLS)
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    assert (count_losses(mesh, occluder, projections, 32, CELLS) == whole).all()


def test_what_cannot_be_drawn_is_refused():
    mesh = soup(np.zeros((1, 3, 3)))
    with pytest.raises(ValueError, match="finite"):
        count_losses(mesh, soup(np.full((1, 3, 3), np.nan)), projections_of(np.eye(3), 8), 8, 4)
