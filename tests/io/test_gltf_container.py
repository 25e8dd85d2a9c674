"""Chunks, versions, compression and the error bound in the extras."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from simplifier.errors import UnreadableMeshError
from simplifier.io import gltf_container
from simplifier.io.load import load, load_occluder
from tests.io.builders import (
    TRIANGLE,
    GltfBuilder,
    tetrahedron_gltf,
)


@pytest.mark.parametrize("version", ["1.0", "3.0", None, 2])
def test_other_versions(load, version: object) -> None:
    builder = tetrahedron_gltf()
    builder.root["asset"]["version"] = version
    with pytest.raises(UnreadableMeshError, match=r"glTF 2"):
        load(builder)


def test_unknown_chunks_and_bytes_behind_the_end(tmp_path: Path) -> None:
    data = tetrahedron_gltf().glb() + struct.pack("<I4s", 4, b"XTRA") + b"abcd"
    whole = data[:8] + struct.pack("<I", len(data)) + data[12:]
    for content in (data, whole):
        path = tmp_path / "scene.glb"
        path.write_bytes(content)
        assert len(load(path).faces) == 4


@pytest.mark.parametrize(
    "name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"]
)
def test_required_compression_is_named(load, name: str) -> None:
    builder = tetrahedron_gltf()
    builder.root["extensionsRequired"] = [name]
    with pytest.raises(UnreadableMeshError, match=f"{name}.*save it uncompressed"):
        load(builder)


def test_draco_without_a_fallback(load) -> None:
    builder = GltfBuilder()
    stored = builder.raw_accessor(componentType=5126, count=3, type="VEC3")
    extensions = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    primitive = {"attributes": {"POSITION": stored}, "extensions": extensions}
    builder.node(mesh=builder.primitives(primitive))
    with pytest.raises(UnreadableMeshError, match="draco"):
        load(builder)


def test_draco_with_a_fallback_is_read(load) -> None:
    builder = tetrahedron_gltf()
    primitive = builder.root["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {}}
    assert len(load(builder)) == 4


def test_meshopt_without_a_fallback(tmp_path: Path) -> None:
    builder = tetrahedron_gltf()
    builder.root["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    path = tmp_path / "scene.gltf"
    path.write_bytes(builder.json())
    with pytest.raises(UnreadableMeshError, match="EXT_meshopt_compression"):
        load(path)


@pytest.mark.parametrize(
    "text", [b"{", b"[]", b"{}", b"\xff", b"[" * 100_000, b'{"asset": {"version": 1' + b"0" * 5000]
)
def test_json_that_is_no_gltf(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "scene.gltf"
    path.write_bytes(text)
    with pytest.raises(UnreadableMeshError):
        load(path)


@pytest.mark.parametrize(
    ("extras", "bound"),
    [
        ({"generator": "planar-occluder", "error_bound": 0.5}, 0.5),
        ({"generator": "planar-occluder", "error_bound": 0}, 0.0),
        ({"generator": "planar-occluder"}, float("inf")),
        ({"generator": "planar-occluder", "error_bound": -1}, float("inf")),
        ({"generator": "planar-occluder", "error_bound": "0.5"}, float("inf")),
        ({"generator": "planar-occluder", "error_bound": True}, float("inf")),
        ({"generator": "something else", "error_bound": 0.5}, float("inf")),
        (["planar-occluder"], float("inf")),
        (None, float("inf")),
    ],
)
def test_error_bound_of_the_extras(tmp_path: Path, extras: object, bound: float) -> None:
    builder = tetrahedron_gltf()
    builder.root["nodes"][0]["extras"] = extras
    path = tmp_path / "occluder.glb"
    path.write_bytes(builder.glb())
    assert load_occluder(path).error_bound == bound


def test_joined_occluders_have_the_largest_bound(tmp_path: Path) -> None:
    builder = tetrahedron_gltf()
    mesh = builder.mesh(TRIANGLE)
    for bound in (0.5, 2.0, 1.0):
        extras = {"generator": "planar-occluder", "error_bound": bound}
        builder.node(mesh=mesh, extras=extras)
    path = tmp_path / "occluder.glb"
    path.write_bytes(builder.glb())
    assert load_occluder(path).error_bound == 2.0
    assert json.loads(builder.json())  # the builder makes valid JSON


TEXTS = st.sampled_from(
    [
        '"a"',
        '"b"',
        '"a\\":"',
        '"\\u0022:"',
        '"\\"\\u003A"',
        '"a :"',
        '"\\u0061"',
        '"\u00e4"',
        '"\\ud83d"',
    ]
)
SPACES = st.sampled_from(["", "", "", " ", "\n", " \t"])


@st.composite
def json_texts(draw: st.DrawFn, depth: int = 3) -> str:
    kind = draw(st.sampled_from(["object", "list", "plain"])) if depth else "plain"
    if kind == "plain":
        return draw(st.one_of(TEXTS, st.sampled_from(["1", "2.50", "1e400", "NaN", "null", "-0"])))
    values = [draw(json_texts(depth - 1)) for _ in range(draw(st.integers(0, 3)))]
    if kind == "list":
        return f"[{','.join(values)}]"
    members = [f"{draw(TEXTS)}{draw(SPACES)}:{draw(SPACES)}{value}" for value in values]
    return "{" + ",".join(members) + "}"


def parsed(data: bytes, large: int) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gltf_container, "_LARGE", large)
        try:
            return repr(gltf_container.parse_json(data, "scene.gltf").members)
        except UnreadableMeshError as error:
            return str(error)


@given(json_texts().map(lambda text: '{"extras":' + text + "}"))
@example('{"extras":{"a":1,"a":2}}')
@example('{"extras":{"a":1,"a":2,"b":"\\u0022:"}}')  # a name is lost, and another seems to be there
@example('{"extras":{"a":1,"a":2,"b":"\\"\\u003a"}}')
@example('{"extras":{"a":1,"a" :2,"b":3}}')
@example('{"extras":' + 300 * "[" + 300 * "]" + "}")
def test_large_files_are_parsed_as_small_ones(text: str) -> None:
    """By another library, which keeps the last of two members of one name."""
    data = text.encode("utf-8")
    assert parsed(data, large=0) == parsed(data, large=1 << 30)
