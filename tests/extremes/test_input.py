"""What users feed: the right mesh, or a refusal that says what is wrong, where, and what to do."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import simplifier
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.errors import EmptyMeshError, MeshError, UnreadableMeshError
from simplifier.io.formats import readable_suffixes
from tests.allocating import most_allocated
from tests.extremes.inputs import CASES, Refused, Usable
from tests.io.builders import XYZ, GltfBuilder, ply

REFUSED = {name: case for name, case in CASES.items() if isinstance(case, Refused)}
USABLE = {name: case for name, case in CASES.items() if isinstance(case, Usable)}

LITTLE = 1 << 20  # bytes
A_LOT = 64 << 20
FAST = {"budget": 12, "resolution": 12, "preset": "draft", "moves": 50}


def written(folder: Path, case: Refused | Usable) -> Path:
    path = folder / f"mesh{case.suffix}"
    path.write_bytes(case.data)
    return path


@pytest.mark.parametrize("name", REFUSED)
def test_a_refusal_says_what_and_where_and_what_to_do(tmp_path: Path, name: str) -> None:
    case = REFUSED[name]
    path = written(tmp_path, case)
    with pytest.raises(case.error, match=case.words) as caught:
        simplifier.load(path)
    assert type(caught.value) is case.error
    assert str(tmp_path) in caught.value.where
    assert caught.value.remedy


@pytest.mark.parametrize("name", USABLE)
def test_what_can_be_used_is_used_and_the_rest_counted(tmp_path: Path, name: str) -> None:
    case = USABLE[name]
    mesh = simplifier.load(written(tmp_path, case))
    assert len(mesh.faces) == case.triangles
    assert {reason: count for reason, count in mesh.dropped.counts.items() if count} == case.dropped
    assert np.isfinite(mesh.vertices).all()
    occluder = simplifier.simplify(mesh, **FAST).occluder
    assert len(occluder.faces) <= FAST["budget"]
    low, high = mesh.bounds
    slack = occluder.error_bound + 1e-9 * mesh.extent.max()
    assert (occluder.vertices >= low - slack).all()
    assert (occluder.vertices <= high + slack).all()


def test_the_truck_with_one_vertex_at_1e30_is_hidden_as_the_truck(
    asset: Callable[[str], Path],
) -> None:
    """Its occluder had no triangle: all but the one vertex lay in a single voxel."""
    whole, damaged = (
        simplifier.load(asset(name))
        for name in ("broken_truck.ply", "broken_DERIVED_truck_nan.ply")
    )
    occluder = simplifier.simplify(damaged, preset="draft").occluder
    report = evaluate_accuracy(whole, occluder, AccuracyOptions(views=64))
    assert report.precision > 0.99
    assert report.recall > 0.6  # the triangles that are lost leave a hole into the cabin


def test_a_mesh_too_small_for_floats_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.obj"
    path.write_bytes(b"v 0 0 0\nv 5e-324 0 0\nv 0 5e-324 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match="too small to divide into voxels; scale it up"):
        simplifier.simplify(simplifier.load(path), **FAST)


# --- Truncation


def triangles(count: int) -> np.ndarray:
    """(count, 3, 3) float32."""
    return np.random.default_rng(0).normal(size=(count, 3, 3)).astype("<f4")


def large_ply() -> bytes:
    corners = triangles(3000)
    rows = np.zeros(3000, [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, np.arange(9000).reshape(-1, 3)
    header = (
        f"element vertex 9000\n{XYZ}element face 3000\nproperty list uchar int vertex_indices\n"
    )
    return ply(header, corners.tobytes() + rows.tobytes(), "binary_little_endian")


def large_stl() -> bytes:
    facets = np.zeros(3000, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    facets["corners"] = triangles(3000)
    return b"\0" * 80 + struct.pack("<I", 3000) + facets.tobytes()


def large_glb() -> bytes:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(triangles(3000).reshape(-1, 3)))
    return builder.glb()


def large_off() -> bytes:
    vertices = triangles(500).reshape(-1, 3)
    rows = [" ".join(map(str, row)) for row in vertices.tolist()]
    rows += [f"3 {3 * k} {3 * k + 1} {3 * k + 2}" for k in range(500)]
    return "\n".join(["OFF", "1500 500 0", *rows, ""]).encode()


LARGE = {".ply": large_ply, ".stl": large_stl, ".glb": large_glb, ".off": large_off}


@pytest.mark.parametrize("suffix", LARGE)
def test_a_large_file_cut_anywhere_is_refused(tmp_path: Path, suffix: str) -> None:
    """Small ones are cut at every byte in ``tests/io/test_formats.py``.

    Who loses a digit of the last number of a text cannot be told from who has written it so.
    """
    data, path = LARGE[suffix](), tmp_path / f"mesh{suffix}"
    path.write_bytes(data)
    whole = simplifier.load(path)
    for length in np.linspace(1, len(data) - 6, 150).astype(int).tolist():
        path.write_bytes(data[:length])
        with pytest.raises(UnreadableMeshError):
            simplifier.load(path)
    path.write_bytes(data)
    np.testing.assert_array_equal(simplifier.load(path).vertices, whole.vertices)


def test_a_text_without_an_end_mark_gives_a_prefix(tmp_path: Path) -> None:
    """OBJ does not say how much is to come, so what is there is right, or damaged, never else."""
    corners = triangles(200).reshape(-1, 3).tolist()
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(200)]
    data, path = "\n".join([*lines, ""]).encode(), tmp_path / "mesh.obj"
    path.write_bytes(data)
    whole = simplifier.load(path)
    expected = whole.vertices[whole.faces]
    for length in np.linspace(1, len(data), 150).astype(int).tolist():
        path.write_bytes(data[:length])
        try:
            mesh = simplifier.load(path)
        except (UnreadableMeshError, EmptyMeshError):
            continue
        count = len(mesh.faces)
        # The last index may have lost a digit.
        np.testing.assert_array_equal(mesh.vertices[mesh.faces][:-1], expected[: count - 1])


# --- Nonsense


def zeros(path: Path, size: int) -> None:
    with path.open("wb") as file:
        file.truncate(size)  # takes no room on the disk


def repeated(block: bytes) -> Callable[[Path, int], None]:
    def fill(path: Path, size: int) -> None:
        with path.open("wb") as file:
            for _ in range(size // len(block)):
                file.write(block)

    return fill


NONSENSE = {
    "zeros": zeros,
    "noise": repeated(np.random.default_rng(0).bytes(1 << 20)),
    "words": repeated(b"lorem ipsum dolor sit am\n" * 41_943),
    "one line": repeated(b"x" * (1 << 20)),
}


@pytest.mark.parametrize("suffix", readable_suffixes())
@pytest.mark.parametrize("kind", NONSENSE)
@pytest.mark.parametrize("size", [A_LOT, pytest.param(1 << 30, marks=pytest.mark.slow)])
def test_nonsense_is_refused_unread(tmp_path: Path, kind: str, suffix: str, size: int) -> None:
    """It was read whole, and under .obj searched for a minute a GiB."""
    path = tmp_path / f"mesh{suffix}"
    NONSENSE[kind](path, size)

    def refuse() -> None:
        with pytest.raises(UnreadableMeshError, match=path.name):
            simplifier.load(path)

    try:
        assert most_allocated(refuse) < LITTLE
    finally:
        path.unlink()


def test_a_thousand_instances_take_the_memory_of_their_triangles(tmp_path: Path) -> None:
    case = USABLE["a thousand instances"]
    path = written(tmp_path, case)
    mesh = simplifier.load(path)
    assert (
        most_allocated(lambda: simplifier.load(path))
        < 8 * (mesh.vertices.nbytes + mesh.faces.nbytes) + len(case.data) * 20
    )
