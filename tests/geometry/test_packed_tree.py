"""The arrays of a packed tree: boxes and occluders in the world's numbers."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.packed_tree import MESH, NODE, PART, index_type, index_words
from tests.io.damaged_occs import town


def test_rows_are_as_long_as_the_format_says():
    assert (NODE.itemsize, PART.itemsize, MESH.itemsize) == (64, 12, 48)


@pytest.mark.parametrize(
    ("vertices", "triangles", "kind", "words"),
    [(3, 1, "<u2", 2), (65_535, 2, "<u2", 3), (65_536, 1, "<u4", 3), (0, 0, "<u2", 0)],
)
def test_indices_are_as_wide_as_they_have_to_be(vertices, triangles, kind, words):
    assert index_type(vertices) == np.dtype(kind)
    assert index_words(vertices, triangles) == words


def test_boxes_objects_and_occluders():
    tree = town()
    np.testing.assert_array_equal(tree.boxes[2], [[5e6 + 7, 0, 0], [5e6 + 9, 2, 2]])
    assert tree.object_of.tolist() == [0, 1, 1]
    vertices, faces = tree.mesh(0)
    np.testing.assert_array_equal(vertices, [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
    assert faces.tolist() == [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    assert tree.mesh(2)[1].tolist() == [[0, 1, 2]]
