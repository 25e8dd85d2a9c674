"""Cuts through trees of occluders, against a recursive one and by what each promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.camera import Camera, Lens
from simplifier.hierarchy.occluder_tree import FAR, NEAR
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.hierarchy.tree import build_tree
from simplifier.hierarchy.visible_nodes import CutFinder
from tests.hierarchy.builds import built
from tests.hierarchy.scenes import street

FOCAL = Lens(180, 60.0).focal
SMALLEST = 1.0  # pixels: what hides no more than a disc of that radius


def random_finder(generator, count=60):
    """A tree of boxes with occluders here and there: near ones are exact and of leaves alone."""
    low = generator.uniform(-100.0, 100.0, (count, 3)) * [1.0, 0.1, 1.0]
    tree = build_tree(np.stack([low, low + generator.uniform(0.1, 20.0, (count, 3))], axis=1), 5)
    sizes = np.linalg.norm(tree.bounds[:, 1] - tree.bounds[:, 0], axis=1)
    errors = sizes[:, None] * generator.uniform([0.001, 0.0], [0.1, 0.0], (len(tree), 2))
    radii = sizes[:, None] * generator.uniform(0.05, 0.5, (len(tree), 2))
    absent = generator.random((len(tree), 2)) < 0.3
    absent[~tree.is_leaf, NEAR] = True
    errors[absent], radii[absent] = np.inf, 0.0
    return CutFinder(tree, errors, radii, sizes)


def camera_at(position):
    ahead, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    return Camera.looking(np.asarray(position, dtype=np.float64), ahead, up, 60.0, 0.1)


def distance(finder, node, camera):
    low, high = finder.tree.bounds[node]
    return float(np.linalg.norm(camera.position - np.clip(camera.position, low, high)))


def level_of(finder, node, camera, pixels):
    """The first of a node's occluders that may be drawn and is worth it, or None."""
    away = distance(finder, node, camera)
    for level in (FAR, NEAR):
        error, radius = finder.errors[node, level], finder.radii[node, level]
        sharp = error == 0.0 or (away > error and error * FOCAL / (away - error) <= pixels)
        if sharp and radius > 0.0 and radius * FOCAL >= SMALLEST * away:
            return level
    return None


def plain_cut(finder, camera, pixels, skip, node=0):
    """(node, level) of the cut, in any order."""
    if skip(node):
        return set()
    level = level_of(finder, node, camera, pixels)
    if level is not None:
        return {(node, level)}
    found = set()
    for child in finder.tree.children_of(node):
        if finder.sizes[child] * FOCAL >= SMALLEST * distance(finder, child, camera):
            found |= plain_cut(finder, camera, pixels, skip, child)
    return found


def cut(finder, camera, pixels, skip=lambda node: False):
    return list(finder.cut(camera, FOCAL, pixels, skip))


views = given(
    st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.5, 2.0, 20.0]),
    st.sampled_from([0.0, 30.0, 150.0, 3000.0]),
)  # fmt: skip


def posed(seed, far):
    """(finder, camera, generator)."""
    generator = np.random.default_rng(seed)
    return random_finder(generator), camera_at(generator.normal(size=3) * (far + 1.0)), generator


@settings(max_examples=60)
@views
def test_the_recursive_cut(seed, pixels, far):
    finder, camera, generator = posed(seed, far)
    hidden = set(np.nonzero(generator.random(len(finder.tree)) < 0.1)[0].tolist())
    found = cut(finder, camera, pixels, hidden.__contains__)
    assert len(found) == len(set(found))
    assert set(found) == plain_cut(finder, camera, pixels, hidden.__contains__)


@settings(max_examples=60)
@views
def test_every_leaf_is_covered_once_or_left_out_for_a_reason(seed, pixels, far):
    finder, camera, _ = posed(seed, far)
    tree = finder.tree
    reached, covers = [], np.zeros(len(tree.order), dtype=int)
    for node, _level in cut(finder, camera, pixels, lambda node: reached.append(node) or False):
        covers[tree.below(node)] += 1
    assert covers.max(initial=0) <= 1
    parent = {child: node for node in range(len(tree)) for child in tree.children_of(node)}
    for leaf in np.nonzero(tree.is_leaf)[0].tolist():
        if covers[tree.below(leaf)[0]]:
            continue
        if leaf in reached:
            assert level_of(finder, leaf, camera, pixels) is None
            continue
        node = leaf
        while parent[node] not in reached:
            node = parent[node]
        assert finder.sizes[node] * FOCAL < SMALLEST * distance(finder, node, camera)


@settings(max_examples=60)
@views
def test_errors_stay_within_the_pixel_error(seed, pixels, far):
    finder, camera, _ = posed(seed, far)
    for node, level in cut(finder, camera, pixels):
        error = finder.errors[node, level]
        if level == NEAR:
            assert error == 0.0
            assert finder.tree.is_leaf[node]
        else:
            nearest = distance(finder, node, camera) - error
            assert nearest > 0.0
            assert error * FOCAL <= pixels * nearest * (1.0 + 1e-12)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.5, 1e3, 1e9]))
def test_from_inside_no_far_occluder_is_drawn(seed, pixels):
    generator = np.random.default_rng(seed)
    finder = random_finder(generator)
    far = np.nonzero(np.isfinite(finder.errors[:, FAR]))[0]
    node = int(generator.choice(far))
    low, high = finder.tree.bounds[node]
    error = finder.errors[node, FAR]
    # Anywhere in the box, or beside it by less than the error.
    position = generator.uniform(low, high)
    axis = generator.integers(3)
    position[axis] = high[axis] + generator.uniform(0.0, 0.999) * error
    assert (node, FAR) not in cut(finder, camera_at(position), pixels)


@settings(max_examples=60)
@views
def test_less_pixel_error_never_draws_coarser(seed, pixels, far):
    """Each node of the finer cut lies in one of the coarser, or where that draws nothing."""
    finder, camera, _ = posed(seed, far)
    coarse = {node for node, _ in cut(finder, camera, 4.0 * pixels)}
    fine = {node for node, _ in cut(finder, camera, pixels)}
    spans = finder.tree.spans
    for node in fine:
        assert not any(
            other != node
            and spans[node, 0] <= spans[other, 0]
            and spans[other, 1] <= spans[node, 1]
            for other in coarse
        )


@settings(max_examples=60)
@views
def test_nearest_first(seed, pixels, far):
    finder, camera, _ = posed(seed, far)
    away = [distance(finder, node, camera) for node, _ in cut(finder, camera, pixels)]
    assert away == sorted(away)


@settings(max_examples=30)
@views
def test_skip_leaves_out_all_below_and_is_asked_after_nearer_ones_were_drawn(seed, pixels, far):
    finder, camera, generator = posed(seed, far)
    skipped = int(generator.integers(len(finder.tree)))
    drawn, asked = [], []

    def skip(node):
        asked.append((node, len(drawn)))
        return node == skipped

    for node, level in finder.cut(camera, FOCAL, pixels, skip):
        drawn.append((node, level))
    below = set(finder.tree.below(skipped).tolist())
    for node, _ in drawn:
        assert not set(finder.tree.below(node).tolist()) <= below
    for node, before in asked:
        away = distance(finder, node, camera)
        assert all(distance(finder, one, camera) <= away for one, _ in drawn[:before])


def test_a_root_that_is_a_leaf():
    tree = build_tree(np.array([[[0.0] * 3, [1.0] * 3]]), 8)
    finder = CutFinder(tree, np.array([[0.01, 0.0]]), np.array([[0.5, 0.5]]), np.array([1.7]))
    assert cut(finder, camera_at([0.5, 0.5, 0.5]), 1.0) == [(0, NEAR)]
    assert cut(finder, camera_at([0.5, 0.5, -5.0]), 1.0) == [(0, FAR)]
    assert cut(finder, camera_at([0.5, 0.5, -1e4]), 1.0) == []
    assert cut(finder, camera_at([0.5, 0.5, -5.0]), 1.0, lambda node: True) == []


@pytest.fixture(scope="module")
def occluders(tmp_path_factory):
    folder = tmp_path_factory.mktemp("street")
    built(street(24), folder)
    return load_occluder_tree(folder)


def test_of_a_built_scene(occluders):
    finder = CutFinder.of(pack_tree(occluders))
    middle = occluders.tree.bounds[0].mean(axis=0)
    within = cut(finder, camera_at(middle), 0.5)
    assert within
    assert {
        level for node, level in within if distance(finder, node, camera_at(middle)) == 0.0
    } <= {NEAR}
    away = cut(finder, camera_at(middle - np.array([0.0, 0.0, 400.0])), 10.0)
    assert len(away) < len(within)
    assert any(not occluders.tree.is_leaf[node] for node, _ in away)
