"""What files claim before they are read, beside what is then read from them."""

from __future__ import annotations

import base64
import os
from pathlib import Path

import numpy as np
import pytest

from simplifier.errors import MemoryLimitError, MeshError, UnreadableMeshError
from simplifier.geometry.occluder import Occluder
from simplifier.io.load import claim_of, load, load_occluder
from simplifier.io.save import save_occluder
from simplifier.io.scene import load_scene
from tests.conftest import ASSETS
from tests.io.builders import FAN, TETRAHEDRON_FACES, TETRAHEDRON_POINTS, GltfBuilder, ply
from tests.solids import sphere

BALL = sphere(rings=24)
EXACT = (".glb", ".occ", ".ply", ".stl", ".off")


def saved(path: Path) -> Path:
    save_occluder(Occluder(BALL.vertices, BALL.faces, 0.0), path)
    return path


@pytest.mark.parametrize("suffix", [*EXACT, ".obj"])
def test_counts_are_those_that_are_read(tmp_path, suffix):
    path = saved(tmp_path / f"ball{suffix}")
    claim, mesh = claim_of(path), load(path)
    assert (claim.vertices, claim.triangles) == (len(mesh.vertices), len(mesh.faces))
    assert claim.decoding >= path.stat().st_size


def test_those_of_a_godot_occluder_are_guessed_within_a_factor_of_three(tmp_path):
    path = saved(tmp_path / "ball.tres")
    claim, mesh = claim_of(path), load(path)
    for claimed, real in ((claim.vertices, mesh.vertices), (claim.triangles, mesh.faces)):
        assert len(real) / 3 < claimed < 3 * len(real)


def long_obj(path: Path) -> int:
    """Five megabytes: vertices, texture coordinates, then quadrilaterals; how many of these."""
    side = 200
    steps = np.linspace(0.0, 1.0, side)
    lines = [f"v {x:.9f} {y:.9f} 0.0" for x in steps for y in steps]
    lines += [f"vt {x:.9f} {y:.9f}" for x in steps for y in steps]
    corners = [i * side + j + 1 for i in range(side - 1) for j in range(side - 1)]
    lines += [
        "f " + " ".join(f"{one}/{one}" for one in (a, a + 1, a + side + 1, a + side))
        for a in corners
    ]
    path.write_text("\n".join(lines))
    return len(corners)


def test_a_long_text_is_estimated_from_samples(tmp_path):
    path = tmp_path / "grid.obj"
    quads = long_obj(path)
    assert path.stat().st_size > 2 << 20  # or all of it is a sample
    claim = claim_of(path)
    assert claim.vertices == pytest.approx(200 * 200, rel=0.1)
    assert claim.triangles == pytest.approx(2 * quads, rel=0.1)


def test_text_stl_counts_facets(tmp_path):
    facet = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n"
    facet += " endloop\nendfacet\n"
    path = tmp_path / "text.stl"
    path.write_text(f"solid x\n{facet * 40}endsolid x\n")
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (120, 40)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_polygons_of_a_ply_count_as_their_triangles(tmp_path, encoding):
    header = (
        "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\n"
    )
    points, corners = np.array(FAN, "<f4"), np.arange(5, dtype="<i4")
    body = points.tobytes() + b"\5" + corners.tobytes()
    if encoding == "ascii":
        rows = [" ".join(map(str, row)) for row in FAN]
        body = "\n".join([*rows, "5 0 1 2 3 4", ""]).encode()
    path = tmp_path / "fan.ply"
    path.write_bytes(ply(header, body, encoding))
    claim = claim_of(path)
    assert claim.vertices == 5
    assert claim.triangles == (3 if encoding != "ascii" else 1)  # text has no fixed length


@pytest.mark.parametrize("mode", [4, 5, 6])
def test_a_strip_and_a_fan_claim_a_triangle_a_corner(tmp_path, mode):
    scene = GltfBuilder()
    corners = [0, 1, 2, 3, 4, 0]
    scene.node(mesh=scene.mesh(FAN, corners, mode=mode))
    path = tmp_path / "fan.glb"
    path.write_bytes(scene.glb())
    assert claim_of(path).triangles == (2 if mode == 4 else len(corners))


def three_instances() -> GltfBuilder:
    scene = GltfBuilder()
    positions = scene.accessor(TETRAHEDRON_POINTS, "VEC3", "f4")
    indices = scene.accessor(np.ravel(TETRAHEDRON_FACES), "SCALAR", "u2")
    mesh = scene.primitives({"attributes": {"POSITION": positions}, "indices": indices})
    for place in range(3):
        scene.node(mesh=mesh, translation=[float(place), 0.0, 0.0])
    return scene


def test_instances_of_a_gltf_mesh_count_each(tmp_path):
    path = tmp_path / "three.glb"
    path.write_bytes(three_instances().glb())
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (12, 12)


@pytest.mark.parametrize(
    "extra",
    [
        '"plain"',
        "NaN",
        "1e999",
        "123456789012345678901234567890",
        '"\\ud800"',
        '{"twice": 1, "twice": 2}',
    ],
)
@pytest.mark.parametrize("begin", ["", "\ufeff"])
def test_long_json_claims_what_short_json_claims(tmp_path, extra, begin):
    scene = three_instances()
    scene.root["extras"] = ["here", "long" * (1 << 18)]
    data = base64.b64encode(scene.binary).decode()
    text = scene.json(uri=f"data:application/octet-stream;base64,{data}").decode()
    path = tmp_path / "long.gltf"
    path.write_text(begin + text.replace('"here"', extra), encoding="utf-8")
    claim = claim_of(path)
    assert (claim.vertices, claim.triangles) == (12, 12)


@pytest.mark.parametrize("path", sorted(ASSETS.glob("*.[pg]l[yb]")), ids=lambda path: path.name)
def test_real_meshes_claim_what_they_hold(path):
    claim, mesh = claim_of(path), load(path)
    assert claim.triangles == len(mesh.faces) + mesh.dropped.total
    assert claim.vertices >= len(mesh.vertices)


DAMAGED = {
    "cut.ply": b"ply\nformat ascii 1.0\nelement vertex 9",
    "wild.ply": b"ply\nformat ascii 1.0\nelement vertex 999999999999\nproperty float x\n"
    b"property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n"
    b"end_header\n0 0 0\n",
    "noise.glb": b"glTF" + bytes(range(200)),
    "noise.obj": bytes(range(256)),
    "none.off": b"OFF\n",
}


@pytest.mark.parametrize("name", [*DAMAGED, "absent.ply"])
def test_reading_says_what_is_wrong_with_a_damaged_file(tmp_path, name):
    path = tmp_path / name
    if name in DAMAGED:
        path.write_bytes(DAMAGED[name])
    assert claim_of(path).decoding < 1 << 20
    with pytest.raises(UnreadableMeshError):
        load(path)


@pytest.mark.parametrize("load", [load, load_occluder, load_scene])
@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply"])
def test_a_file_too_large_is_refused_before_it_is_read(tmp_path, load, suffix):
    path = saved(tmp_path / f"ball{suffix}")
    if suffix == ".stl":
        count = (40 << 30) // 50
        with path.open("r+b") as file:
            file.seek(80)
            file.write(count.to_bytes(4, "little"))
    os.truncate(path, (40 << 30) + 84)  # a hole: the disk has no such room
    with pytest.raises(MemoryLimitError, match="to load the mesh, and the limit is 1 GiB"):
        load(path, memory_limit=1.0)


def test_a_pipe_is_refused_as_one(tmp_path):
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(MeshError, match="a pipe"):
        load(tmp_path / "pipe.ply")
