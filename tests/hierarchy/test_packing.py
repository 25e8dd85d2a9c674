"""OccluderTree -> PackedTree: the same tree, rounded so that nothing is hidden for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.errors import OutputError
from simplifier.geometry.packed_tree import NONE
from simplifier.hierarchy.node import COARSENESS
from simplifier.hierarchy.occluder_tree import FAR, NEAR, OccluderTree
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.scene_file import load_occluder_tree
from simplifier.io.occs_file import encode_occs
from tests.hierarchy.builds import built
from tests.hierarchy.scenes import QUICK, fine_box, moved, scene_of, turned


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> OccluderTree:
    """Houses in map coordinates, some turned, some larger, and a wall that is cut into parts."""
    house, wall = fine_box((2.0, 3.0, 2.0)), fine_box((60.0, 1.0, 1.0), cuts=4)
    places = [
        moved(1.7e6 + 5.3 * i, 5.2e6 + 0.1, 9.0 * (i % 2), (1 + i % 3) * turned("z", 17.0 * i))
        for i in range(9)
    ]
    places[4] = places[3].copy()
    places[4][0, 3] += 3.1
    scene = scene_of([house, wall], [0] * 9 + [1], [*places, moved(1.7e6, 5.2e6 - 9.0, 0.1)])
    folder = tmp_path_factory.mktemp("built")
    built(scene, folder)
    return load_occluder_tree(folder)


def test_the_tree_is_the_same(tree):
    packed = pack_tree(tree)
    assert packed.objects == tree.objects
    assert (packed.up, packed.conservative, packed.rows) == ("y", False, tree.options.rows)
    assert packed.about["options"] == tree.options.chosen()
    np.testing.assert_array_equal(packed.object_of, tree.object_of)
    np.testing.assert_array_equal(packed.order, tree.tree.order)
    np.testing.assert_array_equal(packed.nodes["child_count"], tree.tree.children[:, 1])
    np.testing.assert_array_equal(packed.nodes["first_child"], tree.tree.children[:, 0])
    spans = np.column_stack([packed.nodes["first_part"], packed.nodes["part_count"]])
    np.testing.assert_array_equal(np.cumsum(spans, axis=1), tree.tree.spans)
    for node in np.nonzero(tree.tree.is_leaf)[0]:
        assert packed.parts["node"][tree.part_of(node)] == node
    np.testing.assert_array_equal(
        packed.transforms[packed.parts["transform"]], tree.transforms[:, :3]
    )
    assert len(packed.transforms) < len(packed.parts)


def test_boxes_are_rounded_outwards_by_little(tree):
    boxes, bounds = pack_tree(tree).boxes, tree.tree.bounds
    assert (boxes[:, 0] <= bounds[:, 0]).all()
    assert (boxes[:, 1] >= bounds[:, 1]).all()
    assert np.abs(boxes - bounds).max() < 1e-5


def test_errors_are_rounded_up_and_no_less_than_what_is_lacking(tree):
    nodes, errors, radii = pack_tree(tree).nodes, tree.errors(), tree.hiding_radii()
    far, near = tree.occluder_of.T >= 0
    assert far.any()
    assert (nodes["far"] != NONE).tolist() == far.tolist()
    assert (nodes["near"] != NONE).tolist() == near.tolist()
    assert (nodes["far_error"][far] >= errors[far, FAR]).all()
    np.testing.assert_allclose(nodes["far_error"][far], errors[far, FAR], rtol=1e-6)
    extents = (tree.tree.bounds[:, 1] - tree.tree.bounds[:, 0]).max(axis=1)
    least = COARSENESS * extents / tree.options.resolution
    expected = np.maximum(errors[far, FAR], least[far])
    assert (nodes["switch_error"][far] >= expected).all()
    np.testing.assert_allclose(nodes["switch_error"][far], expected, rtol=1e-6)
    np.testing.assert_allclose(nodes["far_radius"], radii[:, FAR], rtol=1e-6)
    np.testing.assert_allclose(nodes["near_radius"], radii[:, NEAR], rtol=1e-6)
    assert not nodes["far_error"][~far].any()


def test_occluders_are_welded_and_the_same(tree):
    packed = pack_tree(tree)
    assert len(packed.positions) < sum(len(one.vertices) for one in tree.occluders)
    for index, occluder in enumerate(tree.occluders):
        vertices, faces = packed.mesh(index)
        np.testing.assert_allclose(
            vertices[faces], occluder.vertices[occluder.faces], rtol=0, atol=1e-6
        )
        assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert len(packed.pairs) == 0


def test_a_conservative_tree_tells_which_edges_are_shared(tree):
    careful = replace(tree, options=replace(QUICK, conservative=True))
    packed = pack_tree(careful)
    assert packed.conservative
    row = packed.meshes[0]
    _, faces = packed.mesh(0)
    first, count = int(row["first_pair"]), int(row["pair_count"])
    for one, other in packed.pairs[first : first + count].tolist():
        ends = [{*faces[c // 3].tolist()} - {faces[c // 3, c % 3]} for c in (one, other)]
        assert ends[0] == ends[1]


def test_the_same_tree_gives_the_same_bytes(tree):
    assert encode_occs(pack_tree(tree)) == encode_occs(pack_tree(tree))


def test_a_scene_beyond_float32_is_refused(tree):
    bounds = tree.tree.bounds * 1e40
    with pytest.raises(OutputError, match="too large for 32-bit"):
        pack_tree(replace(tree, tree=replace(tree.tree, bounds=bounds)))
