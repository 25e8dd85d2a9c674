"""The contract that every format that can be written has to keep."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simplifier.errors import OutputError
from simplifier.geometry.occluder import Occluder
from simplifier.io.formats import CODECS, writable_suffixes
from simplifier.io.load import load, load_occluder
from simplifier.io.save import save_occluder
from tests.io.builders import tetrahedron

SUFFIXES = writable_suffixes()
BOUNDED = (".glb", ".occ")  # that have a place for the error bound
EXACT = (".obj", ".off", ".ply", ".tres")


@st.composite
def occluders(draw: st.DrawFn) -> Occluder:
    """Triangles of clear area, anywhere from a watch to a map."""
    count = draw(st.integers(1, 12))
    seed = draw(st.integers(0, 2**32 - 1))
    generator = np.random.default_rng(seed)
    scale = 10.0 ** draw(st.integers(-6, 6))
    offset = generator.uniform(-1.0, 1.0, 3) * 10.0 ** draw(st.integers(-3, 7))
    points = generator.uniform(-1.0, 1.0, (count, 3, 3))
    points += np.eye(3) * 4.0  # keeps every triangle well away from a line
    vertices = points.reshape(-1, 3) * scale + offset
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return Occluder(vertices, faces, draw(st.sampled_from([0.0, 0.25 * scale, float("inf")])))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("round_trip")


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


def test_the_documented_formats_are_there() -> None:
    assert set(SUFFIXES) == {".glb", ".obj", ".occ", ".off", ".ply", ".stl", ".tres"}


def rounding(occluder: Occluder) -> float:
    """How far float32 moves a corner, in longest edges of the bounding box."""
    points = occluder.vertices
    return float(np.abs(points.astype(np.float32) - points).max() / np.ptp(points, axis=0).max())


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(occluder=occluders())
def test_triangles_come_back_in_order(folder: Path, suffix: str, occluder: Occluder) -> None:
    path = folder / f"occluder{suffix}"
    if suffix == ".stl" and rounding(occluder) > 1e-3:
        with pytest.raises(OutputError, match="would move a corner"):
            save_occluder(occluder, path)
        return
    save_occluder(occluder, path)
    back = CODECS[suffix].decode(path.read_bytes(), path)
    corners, before = back[0][back[1]], occluder.vertices[occluder.faces]
    if suffix in EXACT:
        np.testing.assert_array_equal(back[0], occluder.vertices)
        np.testing.assert_array_equal(corners, before)
        return
    # float32 rounds to within 2**-24 of what it holds: of the distance from the centre in GLB
    # and OCC (whose float64 centre adds a rounding), of the coordinate itself in STL.
    held = np.abs(before).max() if suffix == ".stl" else np.ptp(before, axis=(0, 1)).max()
    tolerance = held * 2.0**-24 + np.abs(before).max() * 2.0**-51
    assert np.abs(corners - before).max() <= tolerance


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_load_occluder_gives_the_saved_triangles(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"occluder{suffix}"
    save_occluder(tetrahedron(0.125), path)
    back = load_occluder(path)
    expected = tetrahedron()
    np.testing.assert_array_equal(back.vertices[back.faces], expected.vertices[expected.faces])
    assert back.error_bound == (0.125 if suffix in BOUNDED else float("inf"))
    assert len(load(path).faces) == 4


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_an_occluder_that_hides_nothing(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"occluder{suffix}"
    empty = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), 0.5)
    save_occluder(empty, path)
    back = load_occluder(path)
    assert (len(back.faces), len(back.vertices)) == (0, 0)
    assert back.error_bound == (0.5 if suffix in BOUNDED else float("inf"))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_same_occluder_same_bytes(tmp_path: Path, suffix: str) -> None:
    for name in ("a", "b"):
        save_occluder(tetrahedron(0.1), tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_nothing_but_the_file_is_left(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"occluder{suffix}"
    path.write_bytes(b"old")
    save_occluder(tetrahedron(), path)
    assert names(tmp_path) == [path.name]
    assert len(load_occluder(path).faces) == 4


def test_the_file_mode_follows_the_umask(tmp_path: Path) -> None:
    path = tmp_path / "occluder.ply"
    before = os.umask(0o027)
    try:
        save_occluder(tetrahedron(), path)
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_failed_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "occluder.ply"
    path.write_bytes(b"old")

    def full_disk(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full_disk)
    with pytest.raises(OutputError, match="No space left"):
        save_occluder(tetrahedron(), path)
    assert names(tmp_path) == [path.name]
    assert path.read_bytes() == b"old"


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real.ply").write_bytes(b"old")
    (tmp_path / "link.ply").symlink_to("real.ply")
    save_occluder(tetrahedron(), tmp_path / "link.ply")
    assert (tmp_path / "link.ply").is_symlink()
    assert len(load_occluder(tmp_path / "real.ply").faces) == 4


@pytest.mark.parametrize("name", ["occluder.gltf", "occluder.xyz", "occluder"])
def test_suffixes_that_cannot_be_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match=r"cannot be written; use one of \.glb \.obj"):
        save_occluder(tetrahedron(), tmp_path / name)
    assert names(tmp_path) == []


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="there is no folder"):
        save_occluder(tetrahedron(), tmp_path / "absent" / "occluder.glb")


def test_a_file_where_the_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError):
        save_occluder(tetrahedron(), tmp_path / "file" / "occluder.glb")


def test_a_folder_where_the_file_should_be(tmp_path: Path) -> None:
    (tmp_path / "occluder.glb").mkdir()
    with pytest.raises(OutputError, match="folder"):
        save_occluder(tetrahedron(), tmp_path / "occluder.glb")
    assert names(tmp_path) == ["occluder.glb"]


def test_nul_in_the_name(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        save_occluder(tetrahedron(), str(tmp_path / "nul\0.glb"))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_write_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputError, match="permission"):
            save_occluder(tetrahedron(), tmp_path / "occluder.glb")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_coordinates_that_are_not_finite(tmp_path: Path, suffix: str, value: float) -> None:
    points = tetrahedron().vertices.copy()
    points[2, 1] = value
    with pytest.raises(OutputError, match="not finite"):
        save_occluder(Occluder(points, tetrahedron().faces), tmp_path / f"occluder{suffix}")


def test_faces_out_of_range(tmp_path: Path) -> None:
    wrong = Occluder(tetrahedron().vertices, np.array([[0, 1, 4]], dtype=np.int32))
    with pytest.raises(OutputError, match="does not have"):
        save_occluder(wrong, tmp_path / "occluder.ply")


@pytest.mark.parametrize("suffix", [".glb", ".stl"])
def test_what_float32_cannot_hold(tmp_path: Path, suffix: str) -> None:
    for scale in (1e39, 1e308):
        wide = Occluder((tetrahedron().vertices - 0.5) * 2.0 * scale, tetrahedron().faces)
        with pytest.raises(OutputError, match="too large"):
            save_occluder(wide, tmp_path / f"occluder{suffix}")
    assert names(tmp_path) == []


@pytest.mark.parametrize("scale", [1e-39, 1e-129, 1e-290])
@pytest.mark.parametrize("suffix", [".glb", ".stl"])
def test_what_is_too_small_for_float32(tmp_path: Path, suffix: str, scale: float) -> None:
    small = Occluder((tetrahedron().vertices - 0.5) * scale, tetrahedron().faces)
    with pytest.raises(OutputError, match="too small"):
        save_occluder(small, tmp_path / f"occluder{suffix}")
    save_occluder(small, tmp_path / "occluder.ply")
    assert len(load_occluder(tmp_path / "occluder.ply").faces) == 4


def test_stl_normals_and_no_solid_in_the_header(tmp_path: Path) -> None:
    path = tmp_path / "occluder.stl"
    save_occluder(tetrahedron(), path)
    data = path.read_bytes()
    assert not data.startswith(b"solid")
    normals = np.frombuffer(data, dtype="<f4", offset=84, count=3)
    np.testing.assert_array_equal(normals, [0.0, 0.0, -1.0])
