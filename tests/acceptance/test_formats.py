"""Sides, quads and the original in the file, through the real command."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from examples.castle import castle
from simplifier.geometry.scene import Scene
from simplifier.io.load import load, load_occluder
from simplifier.io.scene_writer import encode_scene
from tests.io.test_glb_writer import take_apart

QUICK = ("--ground", "--preset", "draft", "--moves", "0", "--resolution", "24", "--views", "8",
         "--image", "64")  # fmt: skip


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    path = tmp_path_factory.mktemp("formats") / "castle.glb"
    place = np.zeros(1, dtype=np.int32), np.eye(4)[None]
    path.write_bytes(encode_scene(Scene((castle(),), ("castle",), *place)))
    return path


@pytest.fixture
def made(here):
    """``made(mesh, output, …)``: the file, written by the command in this process."""

    def run(mesh, output, *more):
        done = here("simplify", mesh, "-o", output, *QUICK, *more)
        assert (done.returncode, done.stderr) == (0, "") or "warning" in done.stderr, done.stderr
        return output

    return run


def test_an_occluder_file_holds_what_a_glb_does(made, mesh, tmp_path):
    plain = load_occluder(made(mesh, tmp_path / "a.glb"))
    binary = load_occluder(made(mesh, tmp_path / "a.occ"))
    assert binary.error_bound == plain.error_bound
    corners = plain.vertices[plain.faces]
    np.testing.assert_allclose(binary.vertices[binary.faces], corners, atol=1e-5)


def test_single_sided_files_have_both_windings(made, mesh, tmp_path):
    plain = load_occluder(made(mesh, tmp_path / "a.ply"))
    single = load_occluder(made(mesh, tmp_path / "b.ply", "--sides", "single"))
    assert len(plain.faces) < len(single.faces) <= 2 * len(plain.faces)


def test_quads_are_written_where_triangles_pair_up(made, mesh, tmp_path, here):
    path = made(mesh, tmp_path / "a.obj", "--as-quads")
    sizes = [len(line.split()) - 1 for line in path.read_text().splitlines() if line[:2] == "f "]
    plain = load_occluder(made(mesh, tmp_path / "b.obj"))
    assert sizes.count(4) > 0
    assert sum(size - 2 for size in sizes) == len(plain.faces)
    assert trimesh.load(path).area == pytest.approx(trimesh.load(tmp_path / "b.obj").area)
    done = here("simplify", mesh, "-o", tmp_path / "a.glb", *QUICK, "--as-quads")
    assert done.returncode == 1
    assert "have no quads; write triangles, or one of .obj .off .ply" in done.stderr
    assert not (tmp_path / "a.glb").exists()


@pytest.mark.parametrize("how", ["godot", "lod"])
def test_the_original_is_in_the_file(made, mesh, tmp_path, how, here):
    path = made(mesh, tmp_path / "both.glb", "--with-original", how)
    document, _ = take_apart(path.read_bytes())
    assert document["nodes"][-1]["name"] == {"godot": "castle-occonly", "lod": "castle_lod"}[how]
    assert document["meshes"][:-1] == take_apart(mesh.read_bytes())[0]["meshes"]
    original = load(mesh)
    again = load(path)
    assert len(again.faces) == len(original.faces)
    shown = load_occluder(path)
    assert len(shown.faces) == document["nodes"][-1]["extras"]["triangles"]
    judged = here("evaluate", mesh, path, "--views", "8", "--report", tmp_path / "r.json")
    assert judged.returncode == 0, judged.stderr
    assert json.loads((tmp_path / "r.json").read_text())["recall"] > 0.5


def test_an_occluder_of_an_earlier_run_is_left_out_and_told(made, mesh, tmp_path, here):
    both = made(mesh, tmp_path / "both.glb", "--with-original", "godot")
    report = tmp_path / "r.json"
    done = here("simplify", both, "-o", tmp_path / "a.glb", *QUICK, "--report", report)
    assert done.returncode == 0, done.stderr
    count = len(load_occluder(both).faces)
    told = f"{count} ignored triangles were left out (occluder 'castle-occonly')"
    assert f"warning: {told}" in done.stderr
    (omitted,) = json.loads(report.read_text())["input"]["omitted"]
    assert omitted == {
        "name": "occluder 'castle-occonly'",
        "see_through": False,
        "triangles": count,
    }
    assert told in json.loads(report.read_text())["warnings"]
    plain = made(mesh, tmp_path / "b.glb")
    assert plain.read_bytes() == (tmp_path / "a.glb").read_bytes()


def test_levels_and_the_original_exclude_each_other(mesh, tmp_path, here):
    done = here(
        "simplify", mesh, "-o", tmp_path / "a.glb", *QUICK, "--lods", "2", "--with-original", "lod"
    )
    assert done.returncode == 2
    assert "leave one of the two options out" in done.stderr
