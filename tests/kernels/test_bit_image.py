"""The bit form of the occlusion measure: erosions in numpy, closed forms, and the exact form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from examples.castle import castle
from simplifier.geometry.views import (
    BoundingSphere,
    hemisphere_directions,
    image_axes,
    random_directions,
)
from simplifier.io.load import load
from simplifier.kernels.bit_image import _measure_twice
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.coverage import unpack_masks as unpacked_words
from simplifier.kernels.measure import distance_sum, score_images
from simplifier.selection.measure import bit_measure
from tests.kernels.bits import (
    SIDE,
    annulus,
    blob,
    disc,
    eroded_areas,
    packed,
    rectangle,
    unpacked,
)  # fmt: skip
from tests.pictures import sphere_projections


def measure(mask):
    return bit_measure(packed(mask))


def test_bits_go_there_and_back():
    mask = blob(1, 0.5)
    assert np.array_equal(unpacked(packed(mask)), mask)
    assert packed(rectangle(2, 1))[SIDE // 2 - 1] == 0b11 << 31


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.floats(0.01, 0.99), st.sampled_from([0.0, 0.7, 2.0, 5.0, 12.0])
)
def test_equals_erosions_in_numpy(seed, share, smooth):
    mask = blob(seed, share, smooth)
    assert 2 * measure(mask) == eroded_areas(mask) == _measure_twice(packed(mask))


@pytest.mark.parametrize(
    "mask",
    [
        np.zeros((SIDE, SIDE)),
        np.ones((SIDE, SIDE)),
        rectangle(1, SIDE),
        rectangle(SIDE, 1),
        rectangle(1, 1),
        rectangle(63, 62),
        disc(31.5),
        annulus(10, 31),
        np.eye(SIDE),
        np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 2,
    ],
)
def test_special_shapes_equal_erosions_in_numpy(mask):
    mask = np.asarray(mask, dtype=np.bool_)
    assert 2 * measure(mask) == eroded_areas(mask)


def test_scores_are_sums_over_views():
    images = np.stack([packed(blob(seed)) for seed in range(7)])
    assert score_images(images) == sum(score_images(image[None]) for image in images)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(-9, 9), st.integers(-9, 9), st.integers(0, 7))
def test_moves_turns_and_mirrors_keep_it(seed, right, up, turn):
    # Kept clear of the frame, so that nothing is cut off.
    mask = blob(seed, 0.4, 4.0) & rectangle(40, 40)
    moved = np.roll(mask, (up, right), (0, 1))
    turned = np.rot90(moved.T if turn > 3 else moved, turn)
    assert measure(turned) == measure(mask)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_more_pixels_never_lower_it(seed, other):
    small = blob(seed, 0.3)
    assert measure(small | blob(other, 0.3)) >= measure(small)


def test_unit_is_that_of_the_pixel():
    assert bit_measure(packed(disc(20)), 0.5) == measure(disc(20)) / 8


@pytest.mark.parametrize("radius", [8, 12, 16, 20, 24, 28, 31])
def test_disc(radius):
    # The corners of the octagon reach 8 % beyond the disc of a step, so a disc is used up too soon.
    measure_of_disc = measure(disc(radius))
    assert measure_of_disc == pytest.approx(np.pi * radius**3 / 3, rel=0.07)
    assert measure_of_disc == pytest.approx(distance_sum(disc(radius)), rel=0.04)


@pytest.mark.parametrize("side", [1, 2, 3, 8, 17, 36, 64])
def test_square(side):
    # Cross and square take one pixel off a straight edge: the trapezoid rule errs by side / 3.
    assert measure(rectangle(side, side)) == pytest.approx((side**3 / 6) + side / 3, rel=1e-12)


@pytest.mark.parametrize(("width", "height"), [(64, 10), (10, 64), (33, 50), (7, 8), (2, 60)])
def test_rectangle_equals_the_exact_form(width, height):
    assert measure(rectangle(width, height)) == distance_sum(rectangle(width, height))


@pytest.mark.parametrize(("inner", "outer"), [(5, 15), (10, 30), (4, 28), (20, 30)])
def test_annulus(inner, outer):
    expected = np.pi * (inner + outer) / 2 * (outer - inner) ** 2 / 2
    assert measure(annulus(inner, outer)) == pytest.approx(expected, rel=0.06)


def both_forms(masks):
    """(n,) bit form and (n,) exact form."""
    return (
        np.array([measure(mask) for mask in masks]),
        np.array([distance_sum(mask) for mask in masks]),
    )


def silhouettes(mesh, directions):
    sphere = BoundingSphere.of(mesh)
    maps = sphere_projections(image_axes(directions), sphere.centre, sphere.radius)
    return unpacked_words(coverage_masks(mesh.vertices, mesh.faces, maps, SIDE, SIDE), SIDE)


def test_random_blobs_follow_the_exact_form():
    shares, smooths = (0.1, 0.3, 0.5), (4.0, 6.0, 9.0)
    bits, exact = both_forms([blob(i, shares[i % 3], smooths[i // 3 % 3]) for i in range(240)])
    assert np.corrcoef(bits, exact)[0, 1] > 0.9995
    assert bits.sum() == pytest.approx(exact.sum(), rel=0.01)
    assert np.abs(bits / exact - 1.0).max() < 0.1


def test_views_of_the_castle_follow_the_exact_form():
    # Towers and battlements: the worst case, because all of its views measure about the same.
    bits, exact = both_forms(silhouettes(castle(), hemisphere_directions(128)))
    assert np.corrcoef(bits, exact)[0, 1] > 0.997
    assert bits.sum() == pytest.approx(exact.sum(), rel=0.03)
    assert np.abs(bits / exact - 1.0).max() < 0.12


@pytest.mark.parametrize("name", ["bunny_4968.ply", "buddha_113k.ply", "tree_aspen_leafless.glb"])
def test_views_of_an_asset_follow_the_exact_form(asset, name):
    bits, exact = both_forms(silhouettes(load(asset(name)), random_directions(128, 5)))
    assert np.corrcoef(bits, exact)[0, 1] > 0.999
    assert bits.sum() == pytest.approx(exact.sum(), rel=0.01)
    assert np.abs(bits / exact - 1.0).max() < 0.06


def test_silhouettes_of_all_kinds_follow_the_exact_form(asset):
    names = (
        "bunny_4968.ply", "buddha_113k.ply", "broken_truck.ply", "tree_aspen_leafless.glb",
        "level_dungeon.ply", "building_duplex.glb",
    )  # fmt: skip
    meshes = [castle(), *(load(asset(name)) for name in names)]
    masks = [mask for mesh in meshes for mask in silhouettes(mesh, random_directions(48, 6))]
    bits, exact = both_forms([*masks, *(blob(seed) for seed in range(100))])
    assert np.corrcoef(bits, exact)[0, 1] > 0.999
    assert bits.sum() == pytest.approx(exact.sum(), rel=0.01)
