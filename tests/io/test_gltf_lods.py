"""Chains of levels as files: MSFT_lod in one GLB, a file a level, nothing stale, nothing half."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.errors import OutputError, UnknownFormatError, UnreadableMeshError
from simplifier.geometry.camera import Lens
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.io.formats import writable_suffixes
from simplifier.io.glb_writer import encode_lods, screen_coverages
from simplifier.io.gltf_container import pack_glb
from simplifier.io.load import load, load_lods, load_occluder
from simplifier.io.save import is_level_path, save_lods, save_occluder
from tests.io.builders import TRIANGLE, GltfBuilder, tetrahedron
from tests.io.test_glb_writer import stored, take_apart
from tests.solids import box, sphere


def chain(count: int = 3, offset: float = 0.0) -> LodChain:
    """Fewer and fewer triangles of a ball, on an odd number of 16-bit indices in between."""
    ball = sphere(rings=6)
    levels = [
        Level(
            Occluder(ball.vertices + offset, ball.faces[: 21 - 4 * index], 0.1 * 2.0**index),
            64 >> index,
            0.05 * 2.0**index,
        )
        for index in range(count)
    ]
    return LodChain(tuple(levels), Lens(720, 50.0), 2.0)


def corners(mesh: object) -> np.ndarray:
    return np.asarray(mesh.vertices)[np.asarray(mesh.faces)]


def test_structure_of_the_extension() -> None:
    made = chain()
    document, binary = take_apart(encode_lods(made))
    assert document["extensionsUsed"] == ["MSFT_lod"]
    assert "extensionsRequired" not in document
    assert document["scenes"][document["scene"]]["nodes"] == [0]
    finest, *coarser = document["nodes"]
    assert finest["extensions"] == {"MSFT_lod": {"ids": [1, 2]}}
    assert all("extensions" not in node for node in coarser)
    assert [node["mesh"] for node in document["nodes"]] == [0, 1, 2]
    for index, (node, level) in enumerate(zip(document["nodes"], made.levels, strict=True)):
        extras = node["extras"]
        assert node["name"] == f"occluder_lod{index}"
        assert extras["level"] == index
        assert extras["triangles"] == level.triangles
        assert extras["error_bound"] == level.error_bound
        assert extras["deviation"] == level.deviation
        assert extras["resolution"] == level.resolution
        assert extras["switch_distance"] == made.switch_distance(index)
        assert extras["lens"] == {"screen_height": 720, "fov": 50.0, "pixel_error": 2.0}
        primitive = document["meshes"][index]["primitives"][0]
        points = stored(document, binary, primitive["attributes"]["POSITION"])
        indices = stored(document, binary, primitive["indices"]).reshape(-1, 3)
        found = points[indices].astype(float) + node["translation"]
        np.testing.assert_allclose(found, corners(level.occluder), atol=1e-6)
    assert 0 <= len(binary) - document["buffers"][0]["byteLength"] < 4


def test_screen_coverages() -> None:
    """As high as the ball is on the screen where the next level takes over, seen from there."""
    made = chain()
    coverages = screen_coverages(made)
    document, _ = take_apart(encode_lods(made))
    assert document["nodes"][0]["extras"]["MSFT_screencoverage"] == coverages
    assert len(coverages) == 3
    assert 1.0 > coverages[0] > coverages[1] > coverages[2] == 0.0
    points = corners(made.levels[0].occluder).reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = np.linalg.norm(points - (low + high) / 2.0, axis=1).max()
    away = made.switch_distance(1) + radius  # of the centre
    half_angle = math.asin(radius / away)
    assert coverages[0] == pytest.approx(math.tan(half_angle) / math.tan(math.radians(25.0)))


def test_coverage_is_all_where_the_switch_is_at_the_eye() -> None:
    near = LodChain(chain().levels, Lens(720, 50.0), 1e9)
    assert screen_coverages(near) == [1.0, 1.0, 0.0]


def test_a_single_level_needs_no_extension() -> None:
    document, _ = take_apart(encode_lods(chain(1)))
    assert "extensionsUsed" not in document
    assert "extensions" not in document["nodes"][0]
    assert "MSFT_screencoverage" not in document["nodes"][0]["extras"]


def test_there_and_back(tmp_path: Path) -> None:
    made = chain(offset=5_176_000.0)
    paths = save_lods(made, tmp_path / "ball.glb")
    assert [path.name for path in paths] == [f"ball_lod{index}.glb" for index in range(3)]
    back = load_lods(tmp_path / "ball.glb")
    assert (back.lens, back.pixel_error) == (made.lens, made.pixel_error)
    for old, new, path in zip(made.levels, back.levels, paths, strict=True):
        assert (new.error_bound, new.deviation) == (old.error_bound, old.deviation)
        assert new.resolution == old.resolution
        np.testing.assert_allclose(corners(new.occluder), corners(old.occluder), atol=1e-6)
        alone = load_occluder(path)
        assert alone.error_bound == old.error_bound
        np.testing.assert_array_equal(corners(alone), corners(new.occluder))


@pytest.mark.parametrize("count", [1, 2])
def test_the_finest_level_is_what_others_see(tmp_path: Path, count: int) -> None:
    made = chain(count)
    save_lods(made, tmp_path / "ball.glb")
    finest = corners(made.levels[0].occluder)
    np.testing.assert_allclose(corners(load(tmp_path / "ball.glb")), finest, atol=1e-6)
    occluder = load_occluder(tmp_path / "ball.glb")
    assert (len(occluder.faces), occluder.error_bound) == (len(finest), 0.1)
    other = trimesh.load(tmp_path / "ball.glb", process=False, force="mesh")
    np.testing.assert_allclose(corners(other), finest, atol=1e-6)


def test_without_a_default_scene_the_finest_alone_counts(tmp_path: Path) -> None:
    document, binary = take_apart(encode_lods(chain()))
    del document["scene"], document["scenes"]
    (tmp_path / "ball.glb").write_bytes(pack_glb(document, binary))
    assert len(load(tmp_path / "ball.glb").faces) == 21
    assert len(load_lods(tmp_path / "ball.glb").levels) == 3


def test_under_a_parent(tmp_path: Path) -> None:
    """Where an editor has moved the finest level, the others are moved, too."""
    document, binary = take_apart(encode_lods(chain()))
    document["nodes"].append({"children": [0], "translation": [10.0, 0.0, 0.0]})
    document["scenes"] = [{"nodes": [3]}]
    (tmp_path / "ball.glb").write_bytes(pack_glb(document, binary))
    back = load_lods(tmp_path / "ball.glb")
    for old, new in zip(chain().levels, back.levels, strict=True):
        expected = np.add(corners(old.occluder), (10.0, 0.0, 0.0))
        np.testing.assert_allclose(corners(new.occluder), expected, atol=1e-5)


def test_an_occluder_without_a_triangle(tmp_path: Path) -> None:
    empty = Level(Occluder(np.empty((0, 3)), np.empty((0, 3), np.int32), 0.5), 8, 0.0)
    save_lods(LodChain((empty,)), tmp_path / "nothing.glb")
    (level,) = load_lods(tmp_path / "nothing.glb").levels
    assert (level.triangles, level.error_bound) == (0, 0.5)


def _extras(node: int, **changes: object):
    def damage(document: dict) -> None:
        extras = document["nodes"][node]["extras"]
        for key, value in changes.items():
            extras[key] = value

    return damage


def _ids(*ids: object, node: int = 0):
    def damage(document: dict) -> None:
        document["nodes"][node]["extensions"] = {"MSFT_lod": {"ids": list(ids)}}

    return damage


DAMAGE = {
    "missing node": (_ids(1, 7), r"nodes\[7\] is used, but there are 3"),
    "itself": (_ids(0, 1), "form a cycle"),
    "cycle": (_ids(0, node=2), "form a cycle"),
    "twice": (_ids(1, 1), "names a level of detail twice"),
    "no number": (_ids("one"), "not a whole number"),
    "another order": (_ids(2, 1), "this should be level 1"),
    "ids that are no array": (
        lambda document: document["nodes"][0].update(extensions={"MSFT_lod": {"ids": 1}}),
        "'ids' is not an array",
    ),
    "no level": (_extras(1, level=None), "'level' is not a whole number"),
    "no resolution": (_extras(1, resolution=-3), "'resolution' is not a whole number"),
    "no deviation": (_extras(2, deviation="far"), "error bound or deviation is not a length"),
    "a bound below 0": (_extras(2, error_bound=-1.0), "error bound or deviation is not a length"),
    "bounds that fall": (_extras(2, error_bound=0.15), "the error bounds of its levels fall"),
    "no lens": (_extras(0, lens=None), "'screen_height' is not a whole number"),
    "a flat screen": (
        _extras(0, lens={"screen_height": 0, "fov": 60, "pixel_error": 1}),
        "this is not a screen",
    ),
    "no field of view": (
        _extras(0, lens={"screen_height": 9, "fov": 0, "pixel_error": 1}),
        "'fov' is not a positive number",
    ),
    "made elsewhere": (_extras(0, generator="another"), "holds no levels of detail"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_chains(tmp_path: Path, name: str) -> None:
    damage, words = DAMAGE[name]
    document, binary = take_apart(encode_lods(chain()))
    damage(document)
    path = tmp_path / "ball.glb"
    path.write_bytes(pack_glb(document, binary))
    with pytest.raises(UnreadableMeshError, match=words):
        load_lods(path)


def test_several_objects_are_told_from_levels(tmp_path: Path) -> None:
    document, binary = take_apart(encode_lods(chain()))
    document["nodes"].append({**document["nodes"][0], "extensions": {}})
    document["scenes"] = [{"nodes": [0, 3]}]
    (tmp_path / "two.glb").write_bytes(pack_glb(document, binary))
    with pytest.raises(UnreadableMeshError, match="holds levels of several objects"):
        load_lods(tmp_path / "two.glb")


def test_files_without_levels(tmp_path: Path) -> None:
    builder = GltfBuilder()
    builder.node(mesh=builder.mesh(TRIANGLE))
    (tmp_path / "plain.glb").write_bytes(builder.glb())
    with pytest.raises(UnreadableMeshError, match="holds no levels of detail"):
        load_lods(tmp_path / "plain.glb")
    with pytest.raises(UnknownFormatError, match="hold no levels of detail"):
        load_lods(tmp_path / "ball.obj")
    with pytest.raises(UnreadableMeshError, match="there is no such file"):
        load_lods(tmp_path / "absent.glb")


def test_a_mesh_of_another_tool_with_levels(tmp_path: Path) -> None:
    """Its coarser levels lie in the finer ones and are not to be read on top of them."""
    builder = GltfBuilder()
    mesh = builder.mesh(TRIANGLE)
    coarse = builder.node(mesh=mesh, translation=[5, 0, 0])
    fine = builder.node(mesh=mesh, extensions={"MSFT_lod": {"ids": [coarse]}})
    builder.root |= {"scenes": [{"nodes": [fine, coarse]}], "scene": 0}
    (tmp_path / "mesh.glb").write_bytes(builder.glb())
    np.testing.assert_array_equal(corners(load(tmp_path / "mesh.glb")), [TRIANGLE])


@pytest.mark.parametrize("suffix", writable_suffixes())
def test_every_format(tmp_path: Path, suffix: str) -> None:
    paths = save_lods(chain(), tmp_path / f"ball{suffix}")
    whole = {f"ball{suffix}"} if suffix in (".glb", ".occ") else set()
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths} | whole
    for path, level in zip(paths, chain().levels, strict=True):
        back = load_occluder(path)
        assert len(back.faces) == level.triangles
        np.testing.assert_allclose(corners(back), corners(level.occluder), atol=1e-6)


def test_levels_of_an_earlier_run_are_removed(tmp_path: Path) -> None:
    save_lods(chain(5), tmp_path / "ball.glb")
    others = (
        "ball_lod3.obj", "ball_lod.glb", "ball_lod03.glb", "ball_lod7_old.glb", "my_ball_lod4.glb",
        "ball_lod4.glb.bak", "ballXlod4.glb",
    )  # fmt: skip
    for name in others:
        (tmp_path / name).write_bytes(b"mine")
    (tmp_path / "ball_lod12.glb").write_bytes(b"stale")
    save_lods(chain(2), tmp_path / "ball.glb")
    expected = {"ball.glb", "ball_lod0.glb", "ball_lod1.glb", *others}
    assert {path.name for path in tmp_path.iterdir()} == expected
    assert len(load_lods(tmp_path / "ball.glb").levels) == 2


def test_names_with_signs_of_patterns(tmp_path: Path) -> None:
    save_lods(chain(3), tmp_path / "b[a]*l.glb")
    save_lods(chain(1), tmp_path / "b[a]*l.glb")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b[a]*l.glb", "b[a]*l_lod0.glb"]


def test_all_or_nothing(tmp_path: Path) -> None:
    """One level cannot be written: neither the others nor what was there change."""
    save_lods(chain(2), tmp_path / "ball.glb")
    (tmp_path / "ball_lod1.glb").unlink()
    (tmp_path / "ball_lod1.glb").mkdir()
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    with pytest.raises(OutputError, match=r"ball_lod1\.glb: this is a folder"):
        save_lods(chain(3), tmp_path / "ball.glb")
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    assert after == before


def test_what_cannot_be_stored(tmp_path: Path) -> None:
    huge = Level(Occluder(box().vertices * 1e60, box().faces, 1.0), 8, 0.0)
    with pytest.raises(OutputError, match="too large for 32-bit"):
        save_lods(LodChain((huge,)), tmp_path / "huge.glb")
    with pytest.raises(OutputError, match="cannot be written"):
        save_lods(chain(), tmp_path / "ball.xyz")
    with pytest.raises(OutputError, match="there is no folder"):
        save_lods(chain(), tmp_path / "absent" / "ball.glb")
    assert list(tmp_path.iterdir()) == []


def test_the_same_bytes_twice(tmp_path: Path) -> None:
    assert encode_lods(chain()) == encode_lods(chain())


def test_an_unpromised_bound_is_no_number_in_json(tmp_path: Path) -> None:
    levels = (Level(tetrahedron(0.1), 8, 0.0), Level(tetrahedron(), 4, 0.0))
    save_lods(LodChain(levels), tmp_path / "t.glb")
    document, _ = take_apart((tmp_path / "t.glb").read_bytes())
    assert "error_bound" not in document["nodes"][1]["extras"]
    assert "switch_distance" not in document["nodes"][1]["extras"]
    json.dumps(document, allow_nan=False)
    assert math.isinf(load_lods(tmp_path / "t.glb").levels[1].error_bound)


def test_paths_of_levels(tmp_path: Path) -> None:
    output = tmp_path / "castle.glb"
    for name in ("castle_lod0.glb", "castle_lod17.glb"):
        assert is_level_path(tmp_path / name, output)
        assert not is_level_path(tmp_path / "other" / name, output)
    for name in ("castle.glb", "castle_lod1.obj", "castle_lod01.glb", "castle_lodx.glb"):
        assert not is_level_path(tmp_path / name, output)


OCC_DAMAGES = {
    "an error of no pixels": (80, struct.pack("<d", 0.0), "an error of 0.0 pixels"),
    "no field of view": (88, struct.pack("<d", math.nan), "an impossible screen"),
    "a screen of no height": (96, struct.pack("<I", 0), "holds no levels of detail"),
    "a screen of endless height": (96, struct.pack("<I", 2**32 - 1), "an impossible screen"),
    "bounds that fall": (128, struct.pack("<d", 9.0), "the error bounds of its levels fall"),
    "a deviation below 0": (136, struct.pack("<d", -1.0), "deviation of level 0 is -1.0"),
}


@pytest.mark.parametrize("name", OCC_DAMAGES)
def test_an_occluder_file_whose_levels_are_none_is_refused_as_damaged(
    tmp_path: Path, name: str
) -> None:
    """Of the screen an OptionError told, as if the caller had chosen it."""
    path = tmp_path / "ball.occ"
    save_lods(chain(), path)
    offset, patch, said = OCC_DAMAGES[name]
    data = bytearray(path.read_bytes())
    data[offset : offset + len(patch)] = patch
    path.write_bytes(data)
    with pytest.raises(UnreadableMeshError, match=said):
        load_lods(path)


def test_an_occluder_file_of_one_holds_no_levels(tmp_path: Path) -> None:
    save_occluder(tetrahedron(), tmp_path / "one.occ")
    with pytest.raises(UnreadableMeshError, match="holds no levels of detail"):
        load_lods(tmp_path / "one.occ")
