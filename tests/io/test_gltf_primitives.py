"""Strips, fans, points and several primitives a mesh."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.errors import EmptyMeshError, UnreadableMeshError
from tests.io.builders import (
    FAN,
    TRIANGLE,
    GltfBuilder,
)


def test_several_primitives_keep_their_order(load) -> None:
    builder = GltfBuilder()
    first = {"attributes": {"POSITION": builder.accessor(TRIANGLE, "VEC3", "f4")}}
    second = {
        "attributes": {"POSITION": builder.accessor(FAN, "VEC3", "f4")},
        "indices": builder.accessor([4, 3, 2], "SCALAR", "u1"),
    }
    builder.node(mesh=builder.primitives(first, second))
    np.testing.assert_array_equal(load(builder), [TRIANGLE, [FAN[4], FAN[3], FAN[2]]])


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_points_and_lines_are_skipped(load, mode: int) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(FAN, mode=mode))
    with pytest.raises(EmptyMeshError):
        load(builder)
    builder.node(mesh=builder.mesh(TRIANGLE))
    assert len(load(builder)) == 1


@pytest.mark.parametrize("indices", [None, [0, 1, 2, 3, 4]])
def test_fans(load, indices: list[int] | None) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(FAN, indices, mode=6))
    expected = np.array(FAN)[[[0, 1, 2], [0, 2, 3], [0, 3, 4]]]
    np.testing.assert_array_equal(load(builder), expected)


def test_strips_wind_alike_and_lose_their_stitches(load) -> None:
    zigzag = [[x / 2.0, float(x % 2), 0.0] for x in range(6)]
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(zigzag, [0, 2, 1, 3, 3, 2, 2, 4, 3, 5], mode=5))
    corners = load(builder)
    assert len(corners) == 4
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sign(normals[:, 2]) == np.sign(normals[0, 2])).all()


def test_unknown_mode(load) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TRIANGLE, mode=7))
    with pytest.raises(UnreadableMeshError, match="mode 7"):
        load(builder)


def test_an_incomplete_last_triangle_is_ignored(load) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(FAN, [0, 1, 2, 3, 4]))
    assert len(load(builder)) == 1


def test_primitive_without_positions_is_skipped(load) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.primitives({"attributes": {}}))
    builder.node(mesh=builder.mesh(TRIANGLE))
    assert len(load(builder)) == 1
