"""Triangles that leave the solid are pulled into it, and those that cannot be are left out."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.room import Room
from simplifier.kernels.voxelize import is_contained
from simplifier.refinement.search import pull_into

SIZE = 12


def keeps_to(triangle, allowed):
    return is_contained(*(tuple(corner) for corner in triangle.tolist()), Room.of(allowed).voxels)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 8))
def test_what_comes_out_is_inside_and_what_was_inside_is_as_it_was(seed, count):
    rng = np.random.default_rng(seed)
    allowed = np.ones((SIZE,) * 3, dtype=np.bool_)
    allowed[tuple(rng.integers(0, SIZE, (3, 6)))] = False
    soup = rng.uniform(-1.0, SIZE + 1.0, (count, 1, 3)) + rng.uniform(-3.0, 3.0, (count, 3, 3))
    before = soup.copy()
    found = pull_into(soup, Room.of(allowed))
    assert np.array_equal(soup, before)
    assert all(keeps_to(one, allowed) for one in found)
    # In their order: as they were, or smaller about the same centre by sixteenths.
    centres = soup.mean(axis=1)
    places = [np.abs(centres - one.mean(axis=0)).max(axis=1).argmin() for one in found]
    assert places == sorted(set(places))
    for one, place in zip(found, places, strict=True):
        if keeps_to(soup[place], allowed):
            assert np.array_equal(one, soup[place])
            continue
        share = (one - centres[place]) / (soup[place] - centres[place])
        steps = np.log(share.mean()) / np.log(15.0 / 16.0)
        assert np.allclose(share, share.mean(), rtol=1e-6)
        assert 1.0 - 1e-6 < steps < 48.0 + 1e-6
        # And no smaller than it has to be.
        larger = centres[place] + (one - centres[place]) * 16.0 / 15.0
        assert not keeps_to(larger, allowed)
    # Who is left out is still outside at a twentieth of its size.
    for place in set(range(count)) - set(places):
        least = centres[place] + (soup[place] - centres[place]) * (15.0 / 16.0) ** 47
        assert not keeps_to(least, allowed)


def test_one_that_just_fits_at_a_twentieth_of_its_size_is_kept():
    allowed = np.zeros((SIZE,) * 3, dtype=np.bool_)
    allowed[5:7, 5:7, 5:7] = True
    directions = np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    smallest = (15.0 / 16.0) ** 48
    for reach, kept in ((0.99 / smallest, True), (1.01 / smallest, False)):
        assert len(pull_into(6.0 + reach * directions[None], Room.of(allowed))) == kept
