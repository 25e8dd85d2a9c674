"""What holds for every kind of file: the same tetrahedron, and refusals instead of crashes."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simplifier.errors import (
    EmptyMeshError,
    OccluderError,
    UnknownFormatError,
    UnreadableMeshError,
)
from simplifier.io.formats import readable_suffixes
from simplifier.io.load import load, load_occluder
from simplifier.io.scene import load_scene
from tests.io.builders import TETRAHEDRON_FACES, TETRAHEDRON_POINTS, binary_ply, valid_files

FILES = valid_files()
TEXT = [
    name for name in FILES if name in ("dae", "gltf", "obj", "off", "tres") or name.endswith("text")
]
EXPECTED = np.array(TETRAHEDRON_POINTS)[np.array(TETRAHEDRON_FACES)]


def write(folder: Path, name: str, data: bytes | None = None) -> Path:
    suffix, content = FILES[name]
    path = folder / f"mesh{suffix}"
    path.write_bytes(content if data is None else data)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("io")


@pytest.mark.parametrize("name", FILES)
def test_corners_order_and_winding_are_kept(tmp_path: Path, name: str) -> None:
    mesh = load(write(tmp_path, name))
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], EXPECTED)


@pytest.mark.parametrize("name", FILES)
def test_upper_case_suffix_and_text_path(tmp_path: Path, name: str) -> None:
    path = write(tmp_path, name)
    upper = path.rename(path.with_suffix(path.suffix.upper()))
    assert len(load(str(upper)).faces) == 4


@pytest.mark.parametrize("newline", [b"\r\n", b"\r"])
@pytest.mark.parametrize("name", TEXT)
def test_other_line_endings(tmp_path: Path, name: str, newline: bytes) -> None:
    data = FILES[name][1].replace(b"\n", newline)
    mesh = load(write(tmp_path, name, data))
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], EXPECTED)


@pytest.mark.parametrize("name", TEXT)
def test_byte_order_mark(tmp_path: Path, name: str) -> None:
    mesh = load(write(tmp_path, name, b"\xef\xbb\xbf" + FILES[name][1]))
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], EXPECTED)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("obj", b"o body", b"o corps ext\xe9rieur \xff\x80"),
        ("ply text", b"end_header", b"comment \xe9t\xe9\nend_header"),
        ("stl text", b"solid tetrahedron", b"solid \xe9t\xe9"),
        ("off", b"OFF\n", b"OFF # \xe9t\xe9\n"),
    ],
)
def test_bytes_that_are_not_utf8_in_names(
    tmp_path: Path, name: str, old: bytes, new: bytes
) -> None:
    data = FILES[name][1]
    assert old in data
    assert len(load(write(tmp_path, name, data.replace(old, new))).faces) == 4


@pytest.mark.parametrize("name", FILES)
def test_every_truncation_is_refused_or_harmless(folder: Path, name: str) -> None:
    """Only the last bytes may go without notice: a newline, padding, closing words."""
    data = FILES[name][1]
    accepted = []
    for length in range(len(data)):
        path = write(folder, name, data[:length])
        try:
            load(path)
        except EmptyMeshError:
            assert name in ("obj", "tres")  # nothing in these formats says how much is to come
        except UnreadableMeshError:
            pass
        else:
            accepted.append(length)
    if name == "obj":  # a cut between two faces or two digits cannot be seen
        assert min(accepted) > data.index(b"\nf")
    elif name != "tres":
        spare = {"stl text": len(b" tetrahedron\n"), "glb": 0}.get(name, 2)
        assert all(length >= len(data) - spare for length in accepted)


@pytest.mark.parametrize("name", FILES)
def test_empty_file(tmp_path: Path, name: str) -> None:
    with pytest.raises(UnreadableMeshError, match="empty"):
        load(write(tmp_path, name, b""))


@pytest.mark.parametrize("suffix", readable_suffixes())
@pytest.mark.parametrize("data", [b"\0" * 50, b"hello, world\n", bytes(range(256)) * 3, b"\xff"])
def test_nonsense_is_refused(tmp_path: Path, suffix: str, data: bytes) -> None:
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError) as caught:
        load(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("suffix", readable_suffixes())
@pytest.mark.parametrize("name", [name for name in FILES if name != "stl binary"])
def test_wrong_suffix_is_named(tmp_path: Path, suffix: str, name: str) -> None:
    own, data = FILES[name]
    if suffix == own or {suffix, own} == {".glb", ".gltf"}:
        return
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError) as caught:
        load(path)
    if name != "obj":  # has no signature
        assert "the suffix says" in str(caught.value)


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
        (b"PK\x03\x04rest", "ZIP"),
        (b"\x1f\x8b\x08rest", "gzip"),
        (b"<!DOCTYPE html><html>", "web page"),
        ("v 0 0 0\n".encode("utf-16"), "UTF-16"),
    ],
)
def test_frequent_mistakes_are_named(tmp_path: Path, data: bytes, found: str) -> None:
    path = tmp_path / "mesh.obj"
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError, match=found):
        load(path)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(UnreadableMeshError, match="no such file"):
        load(tmp_path / "absent.ply")


def test_folder(tmp_path: Path) -> None:
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(UnreadableMeshError, match="folder"):
        load(tmp_path / "folder.ply")


def test_pipe_does_not_hang(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(UnreadableMeshError, match="pipe"):
        load(tmp_path / "pipe.ply")


def test_impossible_names() -> None:
    for name in ("nul\0.ply", "x" * 5000 + ".ply"):
        with pytest.raises(UnreadableMeshError):
            load(name)


@pytest.mark.parametrize("name", ["mesh.xyz", "mesh", "mesh.ply.gz", ".glb"])
def test_unknown_suffix_lists_the_readable_ones(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(
        UnknownFormatError, match=r"\.3mf \.dae \.glb \.gltf \.obj \.occ \.off \.ply \.stl \.tres"
    ):
        load(tmp_path / name)


def test_no_triangle_is_an_empty_mesh_but_a_proper_occluder(tmp_path: Path) -> None:
    path = tmp_path / "points.obj"
    path.write_bytes(b"v 0 0 0\nv 1 0 0\n")
    with pytest.raises(EmptyMeshError):
        load(path)
    occluder = load_occluder(path)
    assert occluder.faces.shape == (0, 3)
    assert occluder.faces.dtype == np.int32


def test_unusable_triangles_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "mesh.obj"
    path.write_bytes(b"v 0 0 0\nv 1 0 0\nv nan 1 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5")
    mesh = load(path)
    assert len(mesh.faces) == 1
    assert (mesh.dropped.non_finite, mesh.dropped.zero_area) == (1, 1)


@settings(
    max_examples=500, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_never_crash(folder: Path, data: st.DataObject) -> None:
    """Bytes flipped, cut out, doubled and replaced by digits: only our own errors come out."""
    name = data.draw(st.sampled_from(sorted(FILES)))
    content = bytearray(FILES[name][1])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        length = data.draw(st.integers(0, 12))
        patch = data.draw(
            st.one_of(
                st.binary(max_size=8),
                st.sampled_from([b"9" * 18, b"-1", b"1e400", b"nan", b"\xff" * 8, b"null", b"[]"]),
                st.just(bytes(content[at : at + 3 * length])),
            )
        )
        content[at : at + length] = patch
        if not content:
            return
    path = write(folder, name, bytes(content))
    for read in (load, load_occluder, load_scene):
        try:
            read(path)
        except OccluderError as error:
            assert str(path) in str(error)  # noqa: PT017


def test_counts_are_checked_before_memory_is_asked_for(tmp_path: Path) -> None:
    huge = binary_ply().replace(b"element vertex 4", b"element vertex 999999999999")
    for content in (huge, huge.replace(b"vertex 999", b"other 999")):
        path = tmp_path / "mesh.ply"
        path.write_bytes(content)
        with pytest.raises(UnreadableMeshError):
            load(path)
