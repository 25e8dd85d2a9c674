"""The GLB that we write, taken apart by hand and read by trimesh."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from simplifier.geometry.occluder import Occluder
from simplifier.io.glb_writer import encode
from simplifier.io.load import load_occluder
from simplifier.io.save import save_occluder
from tests.io.builders import tetrahedron


def take_apart(data: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert (kind, size % 4) == (b"JSON", 0)
    document = json.loads(data[20 : 20 + size])
    rest = data[20 + size :]
    if rest:
        binary_size, kind = struct.unpack_from("<I4s", rest)
        assert (kind, binary_size % 4, len(rest)) == (b"BIN\0", 0, 8 + binary_size)
    return document, rest[8:]


def stored(document: dict[str, Any], binary: bytes, index: int) -> np.ndarray:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
    width = {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
    count = accessor["count"] * width
    assert view["byteLength"] == count * np.dtype(dtype).itemsize
    assert view["byteOffset"] % 4 == 0
    return np.frombuffer(binary, dtype, count, view["byteOffset"]).reshape(-1, width)


def square(offset: float = 0.0) -> Occluder:
    points = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]) + offset
    return Occluder(points, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), 0.5)


def test_names_material_and_extras() -> None:
    document, binary = take_apart(encode(tetrahedron(0.25)))
    assert document["asset"]["version"] == "2.0"
    (node,), (mesh,), (material,) = (document[key] for key in ("nodes", "meshes", "materials"))
    assert document["scenes"][document["scene"]]["nodes"] == [0]
    assert node["name"] == "occluder"
    expected = {"generator": "planar-occluder", "error_bound": 0.25, "triangles": 4}
    assert node["extras"] == expected
    assert mesh["extras"] == expected
    assert material["doubleSided"] is True
    assert material["pbrMetallicRoughness"]["metallicFactor"] == 0.0
    assert max(material["pbrMetallicRoughness"]["baseColorFactor"][:3]) > 0.5
    assert document["buffers"][0]["byteLength"] <= len(binary)
    assert [view["target"] for view in document["bufferViews"]] == [34962, 34962, 34963]


def test_an_infinite_bound_is_left_out() -> None:
    document, _ = take_apart(encode(tetrahedron()))
    assert "error_bound" not in document["nodes"][0]["extras"]


def test_bounds_are_those_of_the_stored_floats() -> None:
    generator = np.random.default_rng(3)
    faces = np.arange(30, dtype=np.int32).reshape(-1, 3)
    document, binary = take_apart(encode(Occluder(generator.normal(size=(30, 3)), faces)))
    points = stored(document, binary, 0)
    assert document["accessors"][0]["min"] == points.min(axis=0).tolist()
    assert document["accessors"][0]["max"] == points.max(axis=0).tolist()


def test_normals_are_flat_and_of_unit_length() -> None:
    document, binary = take_apart(encode(tetrahedron()))
    points, normals, indices = (stored(document, binary, index) for index in range(3))
    corners = points[indices.reshape(-1, 3)].astype(float)
    expected = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    for k in range(3):
        np.testing.assert_allclose(normals[indices.reshape(-1, 3)[:, k]], expected, atol=1e-6)
    assert len(points) == 12  # no vertex is shared across an edge of the tetrahedron


def test_triangles_of_one_plane_share_vertices() -> None:
    document, _ = take_apart(encode(square()))
    assert document["accessors"][0]["count"] == 4
    assert document["accessors"][2]["count"] == 6


def test_a_triangle_without_area_has_a_unit_normal() -> None:
    flat = Occluder(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    document, binary = take_apart(encode(flat))
    np.testing.assert_array_equal(np.linalg.norm(stored(document, binary, 1), axis=1), 1.0)


def test_the_centre_stands_in_the_translation() -> None:
    document, binary = take_apart(encode(square(5_176_000.125)))
    assert document["nodes"][0]["translation"] == [5_176_001.125] * 2 + [5_176_000.125]
    assert np.abs(stored(document, binary, 0)).max() == 1.0


def test_unused_vertices_do_not_move_the_centre(tmp_path: Path) -> None:
    far = np.vstack([square().vertices, [[1e30, 1e30, 1e30]]])
    save_occluder(Occluder(far, square().faces, 0.5), tmp_path / "occluder.glb")
    back = load_occluder(tmp_path / "occluder.glb")
    np.testing.assert_array_equal(back.vertices[back.faces], square().vertices[square().faces])


@pytest.mark.parametrize(("count", "code"), [(21_844, 5123), (21_845, 5125)])
def test_index_width(count: int, code: int) -> None:
    """65,535 vertices need 32 bits: their last 16-bit index would mean "restart"."""
    generator = np.random.default_rng(0)
    points = generator.normal(size=(3 * count, 3))
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    document, _ = take_apart(encode(Occluder(points, faces)))
    assert document["accessors"][2]["componentType"] == code


def test_without_a_face_there_is_a_node_and_no_mesh() -> None:
    empty = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), 0.5)
    document, binary = take_apart(encode(empty))
    assert document["nodes"][0]["extras"]["triangles"] == 0
    assert "mesh" not in document["nodes"][0]
    assert binary == b""
    # The format forbids empty arrays.
    assert not {"meshes", "accessors", "bufferViews", "buffers", "materials"} & set(document)


def test_trimesh_reads_the_same_triangles(tmp_path: Path) -> None:
    path = tmp_path / "occluder.glb"
    save_occluder(square(100.0), path)
    other = trimesh.load(path, process=False, force="mesh")
    np.testing.assert_allclose(
        np.asarray(other.vertices)[other.faces], square(100.0).vertices[square().faces]
    )
    np.testing.assert_allclose(other.face_normals, [[0, 0, 1], [0, 0, 1]])
