"""What glTF allows in accessors, and every damage to them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from simplifier.errors import UnreadableMeshError
from tests.io.builders import (
    FAN,
    TRIANGLE,
    GltfBuilder,
    tetrahedron_gltf,
)


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
def test_index_types(load, dtype: str) -> None:
    builder = GltfBuilder()
    primitive = {
        "attributes": {"POSITION": builder.accessor(FAN, "VEC3", "f4")},
        "indices": builder.accessor([2, 3, 4], "SCALAR", dtype),
    }
    builder.node(mesh=builder.primitives(primitive))
    np.testing.assert_array_equal(load(builder)[0], FAN[2:5])


@pytest.mark.parametrize(
    ("dtype", "normalized", "factor"),
    [
        ("i1", True, 1 / 127),
        ("u1", True, 1 / 255),
        ("i2", True, 1 / 32767),
        ("u2", True, 1 / 65535),
        ("i1", False, 1.0),
        ("u2", False, 1.0),
    ],
)
def test_quantized_positions(load, dtype: str, normalized: bool, factor: float) -> None:
    builder = GltfBuilder()
    points = np.array([[0, 0, 7], [120, 0, 7], [0, 100, 7]])
    stored = builder.accessor(points, "VEC3", dtype, normalized=normalized)
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    builder.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    np.testing.assert_allclose(load(builder)[0], points * factor, rtol=1e-15)


def test_the_lowest_normalized_value_is_minus_one(load) -> None:
    builder = GltfBuilder()
    points = np.array([[-128, 0, 0], [127, 0, 0], [0, -127, 0]])
    stored = builder.accessor(points, "VEC3", "i1", normalized=True)
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    assert load(builder)[0].tolist() == [[-1, 0, 0], [1, 0, 0], [0, -1, 0]]


def test_interleaved_attributes(load) -> None:
    builder = GltfBuilder()
    rows = b"".join(struct.pack("<3f3f", *point, 9, 9, 9) for point in TRIANGLE)
    place = builder.view(b"\7" * 8 + rows, stride=24)
    stored = builder.raw_accessor(
        bufferView=place, byteOffset=8, componentType=5126, count=3, type="VEC3"
    )
    # The last element ends before its stride does, as it may.
    builder.root["bufferViews"][place]["byteLength"] -= 12
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    np.testing.assert_array_equal(load(builder)[0], TRIANGLE)


@pytest.mark.parametrize("base", [True, False])
def test_sparse_accessors(load, base: bool) -> None:
    builder = GltfBuilder()
    indices = {"bufferView": builder.view(bytes([1, 2])), "componentType": 5121}
    news = np.array(TRIANGLE[1:], dtype="<f4").tobytes()
    sparse = {"count": 2, "indices": indices, "values": {"bufferView": builder.view(news)}}
    if base:
        stored = builder.accessor(np.full((3, 3), 5.0), "VEC3", "f4", sparse=sparse)
    else:
        stored = builder.raw_accessor(componentType=5126, count=3, type="VEC3", sparse=sparse)
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    first = [5.0, 5.0, 5.0] if base else [0.0, 0.0, 0.0]
    np.testing.assert_array_equal(load(builder)[0], [first, *TRIANGLE[1:]])


def test_sparse_index_out_of_bounds(load) -> None:
    builder = GltfBuilder()
    indices = {"bufferView": builder.view(bytes([3])), "componentType": 5121}
    values = {"bufferView": builder.view(b"\0" * 12)}
    sparse = {"count": 1, "indices": indices, "values": values}
    stored = builder.accessor(TRIANGLE, "VEC3", "f4", sparse=sparse)
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    with pytest.raises(UnreadableMeshError, match="not there"):
        load(builder)


def test_zeros_cannot_claim_gigabytes(load) -> None:
    builder = GltfBuilder()
    stored = builder.raw_accessor(componentType=5126, count=10**10, type="VEC3")
    builder.node(mesh=builder.primitives({"attributes": {"POSITION": stored}}))
    with pytest.raises(UnreadableMeshError, match="without any data"):
        load(builder)


@pytest.mark.parametrize(
    ("place", "key", "value", "message"),
    [
        (("accessors", 0), "count", 5, "reach beyond"),
        (("accessors", 0), "count", 10**15, "reach beyond"),
        (("accessors", 0), "count", -1, "whole number"),
        (("accessors", 0), "count", True, "whole number"),
        (("accessors", 0), "byteOffset", 4, "reach beyond"),
        (("accessors", 0), "componentType", 5124, "componentType"),
        (("accessors", 0), "type", "VEC2", "VEC3"),
        (("accessors", 0), "bufferView", 9, "bufferViews"),
        (("accessors", 1), "componentType", 5122, "unsigned"),
        (("bufferViews", 0), "byteLength", 10**9, "ends at byte"),
        (("bufferViews", 0), "buffer", 1, "buffers"),
        (("nodes", 0), "mesh", 3, "meshes"),
        (("nodes", 0), "children", [8], "nodes"),
        (("nodes", 0), "children", 8, "array"),
        (("nodes", 0), "matrix", [1, 2], "16 numbers"),
        (("nodes", 0), "rotation", [0, 0, 0, "1"], "4 numbers"),
        (("nodes", 0), "translation", [0, 0, float("inf")], "3 numbers"),
        (("nodes", 0), "translation", [0, 0, 10**400], "3 numbers"),
        (("meshes", 0), "primitives", [5], "not an object"),
    ],
)
def test_damage_is_named(load, place, key: str, value: object, message: str) -> None:
    builder = tetrahedron_gltf()
    builder.root[place[0]][place[1]][key] = value
    with pytest.raises(UnreadableMeshError, match=message):
        load(builder)


def test_index_out_of_bounds(load) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TRIANGLE, [0, 1, 3]))
    builder.node(mesh=builder.mesh(TRIANGLE))  # vertex 3 of the file, but not of the primitive
    with pytest.raises(UnreadableMeshError, match="names vertex 3, but there are 3"):
        load(builder)
