"""Frames by the headers and by numba's kernels: the same occluders, depths and verdicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.errors import OptionError
from simplifier.geometry.camera import Camera
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.occluder_tree import NEAR, OccluderTree
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.hierarchy.tree import build_tree
from simplifier.kernels.native import library
from simplifier.options.scene import SceneOptions
from tests.culling.occluded import WALL, exact, looking, street, tree_of
from tests.hierarchy.builds import built
from tests.hierarchy.scenes import street as long_street
from tests.rasters import random_camera
from tests.solids import box

has_library = pytest.mark.skipif(library() is None, reason="there is no C compiler here")


def turned(rng):
    """A rotation with a scale."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return axes * rng.uniform(0.5, 2.0)


def random_tree(rng, away=(0.0, 0.0, 0.0), count=40):
    """Things around a place, many of which hide; nodes with far occluders here and there."""
    transforms = np.tile(np.eye(4), (count, 1, 1))
    bounds = np.empty((count, 2, 3))
    meshes = [box(rng.uniform(0.5, 3.0, 3), rng.uniform(-1.0, 0.0, 3)) for _ in range(6)]
    kinds = rng.integers(0, len(meshes), count)
    for part in range(count):
        transforms[part, :3, :3] = turned(rng)
        transforms[part, :3, 3] = rng.uniform(-25.0, 25.0, 3) * [1.0, 1.0, 0.2] + away
        points = meshes[kinds[part]].vertices @ transforms[part, :3, :3].T + transforms[part, :3, 3]
        bounds[part] = points.min(axis=0), points.max(axis=0)
    tree = build_tree(bounds, 4)
    occluders = [exact(mesh) for mesh in meshes]
    occluders += [replace(one, error_bound=rng.uniform(0.01, 0.5)) for one in occluders]
    occluder_of = np.full((len(tree), 2), -1, dtype=np.int32)
    for node in range(len(tree)):
        if tree.children[node, 1] == 0:
            kind = kinds[tree.order[tree.spans[node, 0]]]
            occluder_of[node] = np.where(rng.random(2) < 0.7, [kind + len(meshes), kind], -1)
        elif rng.random() < 0.5:
            low, high = tree.bounds[node]
            made = box((high - low) * 0.8, low + (high - low) * 0.1)
            occluder_of[node, 0] = len(occluders)
            occluders.append(Occluder(made.vertices, made.faces, rng.uniform(0.05, 1.0)))
    names = tuple(f"thing {part}" for part in range(count))
    return OccluderTree(
        SceneOptions(), names, np.arange(count, dtype=np.int32), tree, transforms, occluder_of,
        tuple(occluders), rng.uniform(0.3, 3.0, len(occluders)),
    )  # fmt: skip


def two_ways(tree, rows, columns, coverage="centre", **limits):
    """Cullers by numba and by the headers."""
    plain, compiled = (
        Culler(tree, DepthBuffer(rows, columns, coverage), **limits) for _ in range(2)
    )
    plain.buffer.native = None
    return plain, compiled


def check_same(plain, compiled, camera):
    one, other = plain.cull(camera), compiled.cull(camera)
    assert one.drawn == other.drawn
    assert one.triangles == other.triangles
    np.testing.assert_array_equal(one.verdicts, other.verdicts)
    np.testing.assert_array_equal(plain.buffer.depth, compiled.buffer.depth)
    return one


@has_library
@pytest.mark.parametrize("coverage", ["centre", "inner"])
@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_both_draw_and_judge_alike(coverage, seed):
    """From among the things as well, near and far, with and without a budget and worths."""
    rng = np.random.default_rng(seed)
    away = rng.choice([0.0, 5e6]) * np.array([1.0, 0.9, 0.0])
    packed = pack_tree(random_tree(rng, away))
    if rng.random() < 0.5:
        worth = rng.choice([0.0, 0.5, 1.0, 3.0], len(packed.nodes)).astype(np.float32)
        packed = replace(packed, worth=worth)
    limits = {"pixel_error": rng.choice([0.3, 2.0, 30.0])}
    if rng.random() < 0.5:
        limits["most_triangles"] = int(rng.integers(0, 300))
    plain, compiled = two_ways(packed, 60, 90, coverage, **limits)
    for _ in range(4):
        camera = random_camera(rng)
        place = away + rng.uniform(-30.0, 30.0, 3)
        camera = Camera(place, camera.axes, camera.fov, 0.1)
        culled = check_same(plain, compiled, camera)
        assert culled.triangles <= limits.get("most_triangles", np.inf)


@has_library
def test_a_built_street_is_walked_alike_frame_by_frame(tmp_path):
    built(long_street(24), tmp_path)
    tree = load_occluder_tree(tmp_path)
    low, high = tree.tree.bounds[0]
    seen = set()
    for limits in ({}, {"most_triangles": 60}):
        plain, compiled = two_ways(tree, 45, 80, **limits)
        for step in np.linspace(-0.2, 1.2, 12):
            eye = low + (high - low) * [step, 0.5, 0.3]
            for ahead in ((1.0, 0.1, 0.0), (0.1, -1.0, 0.05)):
                camera = Camera.looking(eye, np.array(ahead), np.array([0.0, 0.0, 1.0]), 70.0, 0.1)
                seen.update(check_same(plain, compiled, camera).verdicts.tolist())
    assert seen == set(Verdict)


def test_a_budget_goes_to_what_hides_most():
    """Of two things the one that fills more of the screen."""
    small = box((0.5, 0.1, 0.5), (8.0, 3.0, 1.0))
    scene = street()
    tree = tree_of(scene, {"wall": exact(WALL), "beside": exact(small)})
    tree = replace(tree, radii=np.array([5.0, 0.6]))
    for native in {library(), None}:
        both, one, none = (
            Culler(tree, DepthBuffer(45, 80), most_triangles=most) for most in (24, 12, 11)
        )
        for culler in (both, one, none):
            culler.buffer.native = native
        assert len(both.cull(looking()).drawn) == 2
        assert one.cull(looking()).triangles == 12
        (node, level) = one.cull(looking()).drawn[0]
        assert level == NEAR
        part = tree.tree.order[tree.tree.spans[node, 0]]
        assert scene.names[tree.object_of[part]] == "wall"
        assert none.cull(looking()).drawn == ()


@pytest.mark.parametrize("worth", [0.0, 1.0])
def test_what_is_worth_nothing_is_drawn_without_a_budget_alone(worth):
    packed = pack_tree(tree_of(street(), {"wall": exact(WALL)}))
    packed = replace(packed, worth=np.full(len(packed.nodes), worth, np.float32))
    for native in {library(), None}:
        for most, drawn in ((None, 1), (100, worth)):
            culler = Culler(packed, DepthBuffer(45, 80), most_triangles=most)
            culler.buffer.native = native
            assert len(culler.cull(looking()).drawn) == drawn


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"tree": None}, "tree"),
        ({"buffer": None}, "buffer"),
        ({"pixel_error": -1.0}, "pixel_error"),
        ({"pixel_error": np.nan}, "pixel_error"),
        ({"pixel_error": "x"}, "pixel_error"),
        ({"most_triangles": -5}, "most_triangles"),
        ({"most_triangles": 2.5}, "most_triangles"),
    ],
)
def test_what_cannot_be_culled_by_is_refused(changes, name):
    """Some of it culled in silence, and the rest failed far below."""
    given = {"tree": tree_of(street(), {"wall": exact(WALL)}), "buffer": DepthBuffer(18, 32)}
    with pytest.raises(OptionError, match=rf"^{name}: "):
        Culler(**{**given, **changes})
    for camera in (None, (0, 0, 0)):
        with pytest.raises(OptionError, match=r"^camera: "):
            Culler(**given).cull(camera)
