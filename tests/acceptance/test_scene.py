"""``occluder scene`` through the real command line."""

from __future__ import annotations

import json
import os
import pty
import shlex
import signal
import subprocess
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import simplifier
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.io.camera_path import save_camera_path
from simplifier.io.scene_writer import write_scene
from tests.acceptance.command import OCCLUDER, ROOT, environment, occluder, read_all, read_until
from tests.io.builders import GltfBuilder
from tests.solids import as_occluder, blob, box, sphere

QUICK = ("--resolution", "10", "--moves", "40", "--budget", "8")
BOX = ([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)],
       [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip


def village(count=24, grown=None):
    """Instances of three meshes in rows; the mesh of object ``grown`` is its own, and larger."""
    meshes = [box((1, 2, 1)), sphere(0.8, rings=8), blob(2)]
    mesh_of = np.arange(count, dtype=np.int32) % 3
    transforms = np.tile(np.eye(4), (count, 1, 1))
    transforms[:, 0, 3] = 40.0 * (np.arange(count) // 6)
    transforms[:, 2, 3] = 50.0 * (np.arange(count) % 6)
    if grown is not None:
        old = meshes[mesh_of[grown]]
        mesh_of[grown] = 3
        meshes.append(TriangleMesh(old.vertices * 1.1, old.faces))
    return Scene(tuple(meshes), tuple(f"house {i}" for i in range(count)), mesh_of, transforms)


def built(run, folder, *more):
    """``run``  ``occluder``, or ``here`` to do without a process of its own."""
    return run("scene", folder / "scene.glb", "-o", folder / "out", *QUICK, *more)


def files(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def made(output):
    """How many occluders were made now, and how many were there."""
    line = next(line for line in output.splitlines() if "made now" in line)
    now, kept = line.split("│")[2].split(",", 1)
    return int(now), int(kept.split()[0])


def test_a_village_and_what_a_change_costs(here, tmp_path, monkeypatch):
    write_scene(village(), tmp_path / "scene.glb")
    first = built(occluder, tmp_path, "--preview")
    assert (first.returncode, first.stderr) == (0, "")
    count, kept = made(first.stdout)
    assert count > 5
    assert kept == 0
    document = json.loads((tmp_path / "out" / "scene.json").read_text())
    jsonschema.validate(document, json.loads((ROOT / "docs" / "scene.schema.json").read_text()))
    assert document["objects"] == [f"house {i}" for i in range(24)]
    for row in document["occluders"].values():
        occluder_made = simplifier.load(tmp_path / "out" / row["file"])
        assert len(occluder_made.faces) == row["triangles"]
    shown = simplifier.load_scene(tmp_path / "out" / "preview.glb")
    assert len(shown) == 24
    before = files(tmp_path / "out")

    packed = tmp_path / "town.occs"
    with monkeypatch.context() as patched:  # what is current is not even loaded
        patched.delattr("simplifier.cli.scene_making.make_scene")
        again = built(here, tmp_path, "--preview", "--packed", str(packed))
    assert made(again.stdout) == (0, count)
    assert files(tmp_path / "out") == before
    assert packed.read_bytes() == before["scene.occs"]
    engine_tree = simplifier.load_packed_tree(packed)
    assert list(engine_tree.objects) == document["objects"]
    assert f"scene.occs, {packed.stat().st_size:,} bytes" in again.stdout

    (tmp_path / "out" / next(iter(document["occluders"].values()))["file"]).write_bytes(b"rot")
    assert made(built(here, tmp_path, "--preview").stdout) == (1, count - 1)
    assert files(tmp_path / "out") == before

    write_scene(village(grown=13), tmp_path / "scene.glb")
    changed = built(here, tmp_path)
    now, kept = made(changed.stdout)
    assert 0 < now <= 5  # near, far and the path to the root
    assert kept >= count - now
    tree = simplifier.load_occluder_tree(tmp_path / "out")
    assert tree.objects[13] == "house 13"
    changed_tree = simplifier.load_packed_tree(tmp_path / "out" / "scene.occs")
    assert len(changed_tree.meshes) > len(engine_tree.meshes)


def test_occluders_are_ranked_along_a_path_or_a_walk_and_not_without(here, tmp_path):
    write_scene(village(), tmp_path / "scene.glb")
    assert built(here, tmp_path).returncode == 0
    plain = files(tmp_path / "out")
    eyes = [[x, 1.0, z] for x in (-5.0, 30.0) for z in (0.0, 25.0)]
    write_path(tmp_path / "walk.json", eyes)
    packed = tmp_path / "town.occs"
    ranked = ("--frame-triangles", "40", "--path", str(tmp_path / "walk.json"))
    done = built(here, tmp_path, *ranked, "--packed", str(packed))
    assert (done.returncode, done.stderr) == (0, "")
    assert "made: ranks alone; all " in done.stdout
    assert "occluders that 8 views drew" in " ".join(done.stdout.replace("│", " ").split())
    tree = simplifier.load_packed_tree(packed)
    assert tree.about["frame_triangles"] == 40
    assert set(tree.worth.tolist()) > {1.0}
    first = files(tmp_path / "out")
    assert first["scene.occs"] == packed.read_bytes()
    assert {**first, "scene.occs": b""} == {**plain, "scene.occs": b""}
    built(here, tmp_path, *ranked)
    assert files(tmp_path / "out") == first
    assert built(here, tmp_path, "--frame-triangles", "40").returncode == 0
    assert built(here, tmp_path).returncode == 0
    assert files(tmp_path / "out") == plain


def test_a_folder_of_meshes_is_a_scene_and_made_again_where_any_of_them_changed(here, tmp_path):
    """It was refused as a file without a suffix."""
    town, out = tmp_path / "town", tmp_path / "out"
    (town / "old").mkdir(parents=True)
    simplifier.save(as_occluder(box()), town / "hall.ply")
    tower = box((1.0, 3.0, 1.0), low=(4.0, 0.0, 0.0))
    simplifier.save(as_occluder(tower), town / "old" / "tower.off")
    builder = GltfBuilder()
    builder.node(name="barn", mesh=builder.mesh(*BOX), translation=[-4, 0, 0])
    data = builder.binary
    (town / "old" / "barn.gltf").write_bytes(builder.json(uri="barn.bin"))
    (town / "old" / "barn.bin").write_bytes(data)
    (town / "lost.glb").write_bytes(b"no mesh")

    def build():
        done = here("scene", town, "-o", out, *QUICK)
        assert done.returncode == 0
        assert "lost.glb" in done.stderr
        return done.stdout

    first = made(build())
    assert first[0] > 2
    assert simplifier.load_occluder_tree(out).objects == ("hall", "old/barn/barn", "old/tower")
    kept = files(out)
    assert made(build()) == (0, sum(first))
    assert files(out) == kept
    larger = np.frombuffer(data[:96], np.float32) * np.float32(1.25)  # its eight corners
    (town / "old" / "barn.bin").write_bytes(larger.tobytes() + data[96:])
    assert made(build())[0] > 0
    simplifier.save(as_occluder(box(low=(0.0, 0.0, 4.0))), town / "mill.obj")
    build()
    assert len(simplifier.load_occluder_tree(out).objects) == 4


def write_path(path, eyes):
    """Cameras of 60 degrees that look along x."""
    ahead, up = np.array([1.0, 0.0, 0.2]), np.array([0.0, 1.0, 0.0])
    cameras = [simplifier.Camera.looking(np.array(eye), ahead, up, 60.0, 0.1) for eye in eyes]
    save_camera_path(simplifier.CameraPath("by hand", tuple(cameras)), path)


def test_a_path_without_a_budget_is_refused_before_anything_is_made(here, tmp_path):
    write_scene(village(), tmp_path / "scene.glb")
    done = built(here, tmp_path, "--path", str(tmp_path / "walk.json"))
    assert done.returncode != 0
    assert "--frame-triangles" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_packed_file_that_has_no_folder_is_refused_before_anything_is_made(here, tmp_path):
    write_scene(village(), tmp_path / "scene.glb")
    done = built(here, tmp_path, "--packed", str(tmp_path / "none" / "town.occs"))
    assert done.returncode == 1
    assert "there is no folder" in done.stderr
    assert not (tmp_path / "out").exists()


def test_bad_objects_are_named_and_the_rest_is_built(here, tmp_path):
    builder = GltfBuilder()
    good = builder.mesh(*BOX)
    points = builder.mesh(BOX[0], mode=0)
    flat = builder.mesh([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[0, 1, 2]])
    builder.node(name="tower", mesh=good)
    builder.node(name="tower", mesh=good, translation=[3, 0, 0])
    builder.node(name="mirror image", mesh=good, translation=[6, 0, 0], scale=[-1, 1, 1])
    builder.node(name="squashed", mesh=good, scale=[1, 0, 1])
    builder.node(name="dots", mesh=points)
    builder.node(name="line", mesh=flat)
    (tmp_path / "scene.glb").write_bytes(builder.glb())
    done = built(here, tmp_path)
    assert done.returncode == 0
    for name in ("'tower", "'squashed'", "'dots'", "'line'"):
        assert name in done.stderr
    assert "mirror image" not in done.stderr
    assert all(line.startswith("warning: ") for line in done.stderr.splitlines())
    tree = simplifier.load_occluder_tree(tmp_path / "out")
    assert tree.objects == ("tower", "tower.2", "mirror image")
    assert (tree.occluder_of[tree.tree.is_leaf] >= 0).any(axis=1).all()


def test_a_scene_without_objects_leaves_nothing(here, tmp_path):
    builder = GltfBuilder()
    builder.node(name="nothing here")
    (tmp_path / "scene.glb").write_bytes(builder.glb())
    done = built(here, tmp_path)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_who_simplifies_a_scene_as_one_mesh_is_shown_the_way(here, tmp_path):
    """Two triangles cannot hide 24 houses."""
    write_scene(village(), tmp_path / "scene.glb")
    made = ("simplify", tmp_path / "scene.glb", "-o", tmp_path / "out.glb", "--budget", "2")
    done = here(*made, "--preset", "draft", "--resolution", "16", "--views", "8", "--image", "64")
    assert simplifier.load(tmp_path / "scene.glb").objects == 24
    tried = next(line for line in done.stderr.splitlines() if line.startswith("try: "))
    assert tried == f"try: occluder scene {tmp_path / 'scene.glb'} -o {tmp_path / 'out'}"
    assert here(*shlex.split(tried)[2:], *QUICK).returncode == 0


def test_an_overhang_is_understood(here, tmp_path):
    write_scene(village(3), tmp_path / "scene.glb")
    for share in ("0.2", "0"):
        assert built(here, tmp_path, "--overhang", share).returncode == 0
        document = json.loads((tmp_path / "out" / "scene.json").read_text())
        assert document["options"]["overhang"] == float(share)


@pytest.mark.parametrize(
    ("more", "name"),
    [
        (("--width", "1"), "width"),
        (("--pixel-error", "0"), "pixel error"),
        (("--fov", "180"), "fov"),
        (("--rows", "0"), "rows"),
        (("--smallest-hole", "-1"), "smallest hole"),
    ],
)
def test_options_out_of_range(here, tmp_path, more, name):
    write_scene(village(3), tmp_path / "scene.glb")
    done = built(here, tmp_path, *more)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {name}: ")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_made_and_the_next_run_goes_on(tmp_path):
    """The scene has more meshes than are done in one process, so there are children to end."""
    meshes = [sphere(0.5 + 0.01 * i, rings=8) for i in range(6)]
    transforms = np.tile(np.eye(4), (6, 1, 1))
    transforms[:, 0, 3] = 3.0 * np.arange(6)
    scene = Scene(tuple(meshes), tuple(map(str, range(6))), np.arange(6, dtype=np.int32),
                  transforms)  # fmt: skip
    write_scene(scene, tmp_path / "scene.glb")
    words = [*OCCLUDER, "scene", tmp_path / "scene.glb", "-o", tmp_path / "out",
             "--resolution", "24", "--moves", "3000", "--budget", "8"]  # fmt: skip
    controller, terminal = pty.openpty()
    with subprocess.Popen(
        words, stderr=terminal, stdout=subprocess.PIPE,
        env=environment(TERM="xterm-256color", COLUMNS="120", OCCLUDER_THREADS="2"),
    ) as process:  # fmt: skip
        os.close(terminal)
        shown = read_until(controller, rb" ([2-9]|1\d)/")  # some may end within a tick
        process.send_signal(signal.SIGINT)
        shown += read_all(controller)
        process.wait(timeout=30)
    os.close(controller)
    assert process.returncode == 130, shown
    told = b" ".join(shown.split())
    assert b"keeps the occluders that were made, run it again for the rest" in told
    assert not (tmp_path / "out" / "scene.json").exists()
    kept = len(list((tmp_path / "out" / "occluders").glob("*.glb")))
    assert kept >= 2
    assert not list(Path(tmp_path / "out").rglob("*.tmp"))
    done = occluder(*map(str, words[len(OCCLUDER) :]))
    assert done.returncode == 0
    assert made(done.stdout)[1] >= kept


def test_a_pool_that_is_not_there_is_refused_in_a_line(tmp_path):
    (tmp_path / "town.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = occluder("scene", "town.obj", "-o", "out", "--pool", "slurm", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: pool: there is no pool 'slurm'; choose ray")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_seconds_that_are_measured_stay_on_one_machine(here, tmp_path):
    done = here("tradeoff", "mesh.glb", "-o", "out", "--pool", "ray", cwd=tmp_path)
    assert done.returncode == 2
    assert "No such option: --pool" in done.stderr
