"""Where a .gltf file may take its data from, and where not."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

import pytest

from simplifier.errors import UnreadableMeshError
from simplifier.io.load import load
from tests.io.builders import tetrahedron_gltf


def write(folder: Path, **buffer: object) -> Path:
    path = folder / "scene.gltf"
    path.write_bytes(tetrahedron_gltf().json(**buffer))
    return path


@pytest.mark.parametrize(
    ("uri", "place"),
    [
        ("scene.bin", "scene.bin"),
        ("buffers/scene.bin", "buffers/scene.bin"),
        ("./scene.bin", "scene.bin"),
        ("two%20words%C3%A9.bin", "two wordsé.bin"),
        ("buffers\\scene.bin", "buffers/scene.bin"),
    ],
)
def test_files_beside_are_read(tmp_path: Path, uri: str, place: str) -> None:
    (tmp_path / "buffers").mkdir()
    (tmp_path / place).write_bytes(tetrahedron_gltf().binary)
    assert len(load(write(tmp_path, uri=uri)).faces) == 4


def test_relative_path_of_the_scene_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scene.bin").write_bytes(tetrahedron_gltf().binary)
    write(tmp_path, uri="scene.bin")
    monkeypatch.chdir(tmp_path)
    assert len(load("scene.gltf").faces) == 4


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin",
        "inner/../../secret.bin",
        "%2e%2e/secret.bin",
        "..%2Fsecret.bin",
        "..\\secret.bin",
        "{outside}/secret.bin",
        "/etc/passwd",
        "%2Fetc%2Fpasswd",
        "\\\\server\\share\\secret.bin",
        "//server/secret.bin",
        "file:///etc/passwd",
        "file:secret.bin",
        "http://127.0.0.1:1/secret.bin",
        "HTTPS://example.org/secret.bin",
        "C:/secret.bin",
        "%43:/secret.bin",
        "link.bin",
        "linked/secret.bin",
        "loop",
        "nul%00.bin",
        "",
    ],
)
def test_everything_else_is_refused_unread(tmp_path: Path, uri: str) -> None:
    """The file outside exists and has the right bytes: only the rule keeps it out."""
    folder, outside = tmp_path / "model", tmp_path
    folder.mkdir()
    (outside / "secret.bin").write_bytes(tetrahedron_gltf().binary)
    (folder / "link.bin").symlink_to("../secret.bin")
    (folder / "linked").symlink_to(outside)
    (folder / "loop").symlink_to("loop")
    path = write(folder, uri=uri.replace("{outside}", str(outside)))
    with pytest.raises(UnreadableMeshError):
        load(path)


def test_a_link_that_stays_inside_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real.bin").write_bytes(tetrahedron_gltf().binary)
    (tmp_path / "link.bin").symlink_to("real.bin")
    assert len(load(write(tmp_path, uri="link.bin")).faces) == 4


@pytest.mark.parametrize("media", ["application/octet-stream", "application/gltf-buffer", ""])
def test_base64(tmp_path: Path, media: str) -> None:
    text = b64encode(tetrahedron_gltf().binary).decode()
    assert len(load(write(tmp_path, uri=f"data:{media};base64,{text}")).faces) == 4


@pytest.mark.parametrize(
    "uri",
    [
        "data:application/octet-stream;base64,AAA",
        "data:application/octet-stream;base64,A*==",
        "data:application/octet-stream;base64,é",
        "data:application/octet-stream,plain",
        "data:",
    ],
)
def test_damaged_base64(tmp_path: Path, uri: str) -> None:
    with pytest.raises(UnreadableMeshError):
        load(write(tmp_path, uri=uri))


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UnreadableMeshError, match=r"absent\.bin"):
        load(write(tmp_path, uri="absent.bin"))


def test_short_file(tmp_path: Path) -> None:
    (tmp_path / "scene.bin").write_bytes(tetrahedron_gltf().binary[:-1])
    with pytest.raises(UnreadableMeshError, match="truncated"):
        load(write(tmp_path, uri="scene.bin"))


@pytest.mark.parametrize("buffer", [{}, {"uri": 5}])
def test_absent_buffer(tmp_path: Path, buffer: dict[str, object]) -> None:
    with pytest.raises(UnreadableMeshError, match="neither data nor"):
        load(write(tmp_path, **buffer))
