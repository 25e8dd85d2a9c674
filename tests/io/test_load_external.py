"""Files that refer to others, where no other file may be opened."""

from __future__ import annotations

import subprocess
import sys
from base64 import b64encode
from pathlib import Path

import pytest

import simplifier
from simplifier.errors import EmptyMeshError, UnreadableMeshError
from simplifier.io.gltf import external
from tests.acceptance.command import environment
from tests.io.builders import tetrahedron_gltf

OUTSIDE = ["../secret.bin", "file:///etc/passwd", "http://127.0.0.1:1/secret.bin", "beside.bin"]


def write(folder: Path, uri: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder.parent / "secret.bin").write_bytes(tetrahedron_gltf().binary)
    (folder / "beside.bin").write_bytes(tetrahedron_gltf().binary)
    path = folder / "scene.gltf"
    path.write_bytes(tetrahedron_gltf().json(uri=uri))
    return path


@pytest.mark.parametrize("uri", OUTSIDE)
@pytest.mark.parametrize("name", ["load", "load_occluder", "load_scene"])
def test_a_file_that_refers_to_another_is_refused(tmp_path: Path, name: str, uri: str) -> None:
    path = write(tmp_path / "in", uri)
    with pytest.raises(UnreadableMeshError, match=r"refers to another file, .*export a single"):
        getattr(simplifier, name)(path, allow_external=False)


@pytest.mark.parametrize(
    "name", [rb"\u0075ri", rb"u\u0072i", rb"ur\u0069", rb"\u0075\u0072\u0069"], ids=bytes.decode
)
def test_however_the_name_of_the_member_is_written(tmp_path: Path, name: bytes) -> None:
    path = write(tmp_path / "in", "beside.bin")
    path.write_bytes(path.read_bytes().replace(b'"uri"', b'"' + name + b'"'))
    assert name in path.read_bytes()
    with pytest.raises(UnreadableMeshError, match="refers to another file"):
        simplifier.load(path, allow_external=False)
    assert external(path.read_bytes(), path) == ["beside.bin"]


def test_a_file_beside_is_read_where_that_is_allowed(tmp_path: Path) -> None:
    path = write(tmp_path / "in", "beside.bin")
    assert len(simplifier.load(path).faces) == 4
    assert len(simplifier.load_occluder(path).faces) == 4
    assert len(simplifier.load_scene(path)) == 1


def test_what_holds_all_of_its_data_is_read(tmp_path: Path) -> None:
    data = b64encode(tetrahedron_gltf().binary).decode()
    path = write(tmp_path / "in", f"data:application/octet-stream;base64,{data}")
    assert len(simplifier.load(path, allow_external=False).faces) == 4
    single = tmp_path / "single.glb"
    single.write_bytes(tetrahedron_gltf().glb())
    assert len(simplifier.load(single, allow_external=False).faces) == 4


def test_of_a_folder_each_file_is_looked_at(tmp_path: Path) -> None:
    write(tmp_path / "in", "beside.bin")
    with pytest.raises(EmptyMeshError, match="refers to another file"):
        simplifier.load_scene(tmp_path / "in", allow_external=False)
    (tmp_path / "in" / "single.glb").write_bytes(tetrahedron_gltf().glb())
    scene = simplifier.load_scene(tmp_path / "in", allow_external=False)
    assert len(scene) == 1
    assert "refers to another file" in scene.warnings[0]


WATCHED = """
import sys, simplifier
from simplifier.errors import UnreadableMeshError
simplifier.load
opened = []
sys.addaudithook(lambda event, what: opened.append(str(what[0])) if event == "open" else None)
for path in sys.argv[1:]:
    try:
        simplifier.load(path, allow_external=False)
    except UnreadableMeshError:
        pass
print(sorted({path for path in opened if path.endswith((".bin", "passwd", ".gltf", ".mtl"))}))
"""


def test_nothing_but_the_given_file_is_opened(tmp_path: Path) -> None:
    paths = [str(write(tmp_path / str(number), uri)) for number, uri in enumerate(OUTSIDE)]
    material = tmp_path / "a.obj"
    material.write_text("mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = subprocess.run(
        [sys.executable, "-c", WATCHED, *paths, str(material)],
        env=environment(), capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == str(sorted(paths))
