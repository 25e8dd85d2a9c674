"""Keys: what they depend on and what not, and how meshes stand."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.hierarchy.node import Stand
from simplifier.hierarchy.node_plan import is_key, plan_occluders
from simplifier.hierarchy.parts import split_large
from simplifier.hierarchy.tree import build_tree
from simplifier.options.scene import SceneOptions
from tests.hierarchy.scenes import (
    QUICK,
    fine_box,
    moved,
    reordered,
    scene_of,
    street,
    turned,
    with_object,
)
from tests.solids import box


def planned(scene, options=QUICK):
    """(plan, tree, parts)."""
    parts = split_large(scene)
    tree = build_tree(parts.bounds, options.width)
    return plan_occluders(parts, tree, options), tree, parts


def keys(scene, options=QUICK):
    return set(planned(scene, options)[0].jobs)


def stand_of_leaf(linear, options, mesh=None):
    scene = scene_of([mesh or fine_box()], [0], [moved(linear=linear)])
    (job,) = [job for job in planned(scene, options)[0].jobs.values() if job.kind == "near"]
    return job.stand


def test_what_has_an_occluder():
    scene = scene_of(
        [box(), fine_box(), fine_box((1.0, 2.0, 1.0))],
        [0, 1, 2, 0, 1, 2],
        [moved(3.0 * i) for i in range(6)],
    )
    plan, tree, parts = planned(scene, replace(QUICK, budget=16))
    for node, node_keys in enumerate(plan.keys):
        if not tree.is_leaf[node]:
            assert node_keys.near is None
            continue
        part = int(tree.below(node)[0])
        assert plan.jobs[node_keys.near].kind == "near"
        few = len(parts.scene.meshes[parts.scene.mesh_of[part]].faces) <= 16
        assert (node_keys.far is None) == few
    assert plan.keys[0].far is not None  # it has parts enough
    # Instances share theirs: three near ones, two far ones.
    kinds = Counter(job.kind for job in plan.jobs.values())
    assert (kinds["near"], kinds["far"]) == (3, 2)
    assert all(is_key(key) for key in plan.jobs)


def test_conservative_leaves_have_no_far_occluder():
    plan, tree, _ = planned(street(), replace(QUICK, conservative=True))
    assert all(plan.keys[node].far is None for node in np.nonzero(tree.is_leaf)[0])


@settings(max_examples=10)
@given(st.randoms(use_true_random=False))
def test_the_order_of_the_objects_does_not_matter(random):
    scene = street(20)
    order = random.sample(range(20), 20)
    assert keys(reordered(scene, order)) == keys(scene)


def changed_nodes(scene, other):
    """(fresh keys, sets of parts of the nodes that have one) of the second scene."""
    plan, tree, _ = planned(other)
    fresh = set(plan.jobs) - keys(scene)
    nodes = [i for i, one in enumerate(plan.keys) if {one.far, one.near} & fresh]
    return fresh, [set(tree.below(node).tolist()) for node in nodes]


def test_a_moved_object_changes_its_path_alone():
    scene = street(24)
    # So little that the tree stays the same.
    fresh, below = changed_nodes(scene, with_object(scene, 5, moved(6.0 + 2.0**-30, 0.0, 4.0)))
    assert 0 < len(fresh) == len(below)
    assert all(5 in parts and len(parts) > 1 for parts in below)


def test_a_changed_mesh_changes_its_leaf_and_its_path():
    scene = street(24)
    mesh = scene.meshes[1]
    bent = TriangleMesh.from_soup(mesh.vertices * [1.0, 1.0, 1.0 + 2.0**-40], mesh.faces)
    other = with_object(scene, 5, mesh=bent)
    fresh, below = changed_nodes(scene, other)
    assert all(5 in parts for parts in below)
    assert {5} in below
    kinds = Counter(planned(other)[0].jobs[key].kind for key in fresh)
    assert (kinds["near"], kinds["far"]) == (1, 1)
    assert kinds["inner"] == len(below) - 1 > 0


def test_options_that_do_not_matter_change_no_key():
    scene = street(24)
    all_of = keys(scene)
    for change in ({"rows": 2160}, {"fov": 20.0}, {"pixel_error": 500.0}):
        some = keys(scene, replace(QUICK, **change))
        assert some <= all_of or all_of <= some
    assert keys(scene, replace(QUICK, up="z")) == all_of  # there is no ground
    leaves = {job.key for job in planned(scene)[0].jobs.values() if job.kind != "inner"}
    assert leaves <= keys(scene, replace(QUICK, width=7))


@pytest.mark.parametrize(
    "change",
    [
        {"budget": 9}, {"resolution": 9}, {"moves": 21}, {"seed": 1}, {"conservative": True},
        {"ground": True}, {"smallest_hole": 0.1},
    ],
)  # fmt: skip
def test_options_that_matter_change_every_key(change):
    scene = street(24)
    assert not keys(scene, replace(QUICK, **change)) & keys(scene)


def test_useful_are_nodes_that_can_be_far_enough_away():
    def inner(pixel_error):
        jobs = planned(street(40), replace(QUICK, pixel_error=pixel_error))[0].jobs
        return sum(job.kind == "inner" for job in jobs.values())

    assert inner(1e-3) == 0 < inner(100.0) <= inner(1000.0)


GROUND = SceneOptions(ground=True)


@pytest.mark.parametrize(
    ("linear", "axis"),
    [
        (np.eye(3), "y"),
        (turned("y", 40.0) * 2.5, "y"),
        (np.diag([-1.0, 1.0, 1.0]), "y"),  # mirrored, as it stands
        (np.diag([1.0, -1.0, 1.0]), None),  # upside down
        (turned("x", -90.0), "z"),  # a z-up file
        (turned("x", -90.0) @ np.diag([-3.0, 1.0, 0.5]), "z"),
        (turned("z", 90.0), "x"),
        (turned("x", 10.0), None),
        (np.array([[1.0, 0.7, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "y"),  # leans, level base
        (np.array([[1.0, 0.0, 0.0], [0.7, 1.0, 0.0], [0.0, 0.0, 1.0]]), None),  # upright on a slope
    ],
)
def test_the_ground_in_a_meshs_own_space(linear, axis):
    assert stand_of_leaf(linear, GROUND) == Stand(ground=axis)
    assert stand_of_leaf(linear, QUICK) == Stand()


def test_the_up_axis_of_the_scene_decides():
    assert stand_of_leaf(np.eye(3), replace(GROUND, up="z")) == Stand(ground="z")
    plan, _, _ = planned(street(), replace(QUICK, ground=True, up="x"))
    assert {job.stand.ground for job in plan.jobs.values()} == {"x"}


def test_instances_that_stand_otherwise_take_the_ground_from_all():
    scene = scene_of([fine_box()], [0, 0], [moved(), moved(3.0, linear=turned("z", 90.0))])
    plan, _, _ = planned(scene, GROUND)
    assert {job.stand for job in plan.jobs.values()} == {Stand()}


def test_pieces_of_an_object_do_not_stand_on_the_ground():
    scene = scene_of([fine_box((90.0, 3.0, 3.0), cuts=8)], [0], [moved()])
    plan, _, parts = planned(scene, replace(QUICK, ground=True))
    assert len(parts.object_of) > 1
    assert {job.stand.ground for job in plan.jobs.values()} == {None}


def test_a_hole_has_the_length_that_it_has_in_the_world():
    options = replace(QUICK, smallest_hole=0.5)
    assert stand_of_leaf(np.eye(3) * 0.01, options) == Stand(smallest_hole=50.0)
    # Of several instances the largest decides, and turning one changes no key.
    scene = scene_of([fine_box()], [0, 0], [moved(), moved(9.0, linear=turned("y", 33.0) * 4.0)])
    plan, _, _ = planned(scene, options)
    assert {job.stand.smallest_hole for job in plan.jobs.values()} == {0.125}
    plan, _, _ = planned(street(), options)
    assert {job.stand.smallest_hole for job in plan.jobs.values()} == {0.5}
