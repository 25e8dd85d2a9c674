"""What Godot makes of the import script, of an ArrayOccluder3D and of nodes "...-occonly"."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

from simplifier.io.load import load
from tests.acceptance.command import ROOT, occluder
from tests.integrations.commands import make_command

GODOT = os.environ.get("GODOT") or shutil.which("godot")
SCRIPT = ROOT / "integrations" / "godot" / "occluder_import.gd"
SHOW = Path(__file__).with_name("show.gd")
WEDGE = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]]) + np.array([0.5, 0.25, -4])
FACES = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]
BALL = "ball.glb"  # 80 triangles, more than the script's budget

pytestmark = pytest.mark.skipif(
    not GODOT, reason="Godot 4 is neither on PATH nor named by the variable GODOT"
)


class Project:
    """A project in a folder, and a Godot that keeps its own files there too."""

    def __init__(self, folder, command):
        self.folder = folder
        (folder / "project.godot").write_text(
            f'config_version=5\n\n[planar_occluder]\n\ncommand="{command}"\n'
        )
        shutil.copy(SCRIPT, folder)
        shutil.copy(SHOW, folder)

    def scene(self, name, transform=None, mesh=None, **parameters):
        """A GLB of the wedge or of another mesh, imported with these parameters."""
        scene = trimesh.Scene()
        mesh = trimesh.Trimesh(WEDGE, FACES, process=False) if mesh is None else mesh
        scene.add_geometry(mesh, transform=transform)
        self.imported(name, scene, **parameters)

    def imported(self, name, scene, **parameters):
        """A scene of trimesh, with the parameters of its import."""
        scene.export(self.folder / name)
        lines = [f"{key}={json.dumps(value)}" for key, value in parameters.items()]
        text = "\n".join(['[remap]\n\nimporter="scene"\n\n[params]\n', *lines, ""])
        (self.folder / f"{name}.import").write_text(text)

    def script(self, name, body):
        """An import script that extends the one of this project."""
        text = f'@tool\nextends "res://{SCRIPT.name}"\n\n\nfunc _init() -> void:\n\t{body}\n'
        (self.folder / name).write_text(text)

    def imports(self):
        """All that Godot says meanwhile."""
        return self._run("--import")

    def shows(self, name):
        """Kind and triangles (m, 3, 3) of the nodes of a scene, or of a resource."""
        said = self._run("--script", f"res://{SHOW.name}", "--", f"res://{name}")
        (line,) = [line for line in said.splitlines() if line.startswith("{")]
        nodes = json.loads(line)["nodes"]
        return [(node["kind"], np.array(node["triangles"]).reshape(-1, 3, 3)) for node in nodes]

    def occluder(self, name):
        """The triangles of a scene's only occluder."""
        (found,) = [shown for kind, shown in self.shows(name) if kind == "OccluderInstance3D"]
        return found

    def _run(self, *arguments):
        own = {
            f"XDG_{kind}_HOME": str(self.folder / ".own") for kind in ("CONFIG", "DATA", "CACHE")
        }
        done = subprocess.run(
            [GODOT, "--headless", *arguments], cwd=self.folder, env={**os.environ, **own},
            capture_output=True, text=True, timeout=240, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """Scenes with the script and without, all imported at once, as a team's first start does."""
    made = Project(tmp_path_factory.mktemp("godot"), make_command(tmp_path_factory.mktemp("bin")))
    ours, place = f"res://{SCRIPT.name}", trimesh.transformations.euler_matrix(0.3, 0.5, 0.7)
    place[:3, 3] = [10, 1, 2]
    made.scene("turned.glb", place, **{"import_script/path": ours})
    made.scene("scaled.glb", place, **{"import_script/path": ours, "nodes/root_scale": 2.0})
    made.script("other.gd", 'budget = 100\n\toptions = ["--preset", "draft"]')
    ball = trimesh.creation.icosphere(subdivisions=1).apply_translation([1.0, 2.0, 3.0])
    made.scene(BALL, mesh=ball, **{"import_script/path": "res://other.gd"})
    made.script("refused.gd", "budget = 0")
    made.scene("refused.glb", **{"import_script/path": "res://refused.gd"})
    glb = made.folder / BALL
    glazed = trimesh.Scene()
    for mode, away in (("OPAQUE", 0.0), ("BLEND", 5.0), ("MASK", 10.0)):
        glass = trimesh.visual.material.PBRMaterial(name=mode, alphaMode=mode)
        part = trimesh.Trimesh(WEDGE + away, FACES, process=False)
        part.visual = trimesh.visual.TextureVisuals(material=glass)
        glazed.add_geometry(part)
    made.imported("glazed.glb", glazed, **{"import_script/path": ours})
    options = ("--budget", "100", "--preset", "draft")
    for written in (("ball_both.glb", "--with-original", "godot"), ("ball.tres",)):
        done = occluder("simplify", glb, "-o", made.folder / written[0], *written[1:], *options)
        assert done.returncode == 0, done.stderr
    made.said = made.imports()
    return made


@pytest.mark.parametrize(("name", "scale"), [("turned.glb", 1.0), ("scaled.glb", 2.0)])
def test_the_script_gives_a_scene_an_occluder_in_its_place(project, name, scale):
    (shown,) = [shown for kind, shown in project.shows(name) if kind == "MeshInstance3D"]
    mesh = load(project.folder / name)
    same_triangles(shown, scale * mesh.vertices[mesh.faces])
    same_triangles(project.occluder(name), shown)


def test_the_script_leaves_out_what_one_can_see_through(project):
    assert len([kind for kind, _ in project.shows("glazed.glb") if kind == "MeshInstance3D"]) == 3
    same_triangles(project.occluder("glazed.glb"), WEDGE[FACES])


def test_a_script_that_extends_it_sets_budget_and_options(project):
    assert len(project.occluder(BALL)) == 80


def test_what_the_command_refuses_is_an_error_of_the_import(project):
    (line,) = [line for line in project.said.splitlines() if "no occluder was made" in line]
    assert "res://refused.glb" in line
    assert "budget: 0 is out of range" in line
    assert [kind for kind, _ in project.shows("refused.glb")] == ["Node3D", "MeshInstance3D"]


def test_no_error_but_that_one(project):
    errors = [line for line in project.said.splitlines() if "ERROR" in line]
    assert [line for line in errors if "no occluder was made" not in line] == []


def test_godot_makes_an_occluder_of_the_node_behind_the_original(project):
    kinds = [kind for kind, _ in project.shows("ball_both.glb")]
    assert sorted(kinds) == ["MeshInstance3D", "Node3D", "OccluderInstance3D"]
    mesh = load(project.folder / BALL)
    same_triangles(project.occluder("ball_both.glb"), mesh.vertices[mesh.faces])


def test_godot_reads_the_resource(project):
    ((kind, shown),) = project.shows("ball.tres")
    assert kind == "Occluder3D"
    mesh = load(project.folder / BALL)
    same_triangles(shown, mesh.vertices[mesh.faces])


def same_triangles(found, expected):
    """Whichever way they wind and whatever comes first, to the digits of float32."""
    assert found.shape == expected.shape
    apart = np.abs(sorted_rows(found) - sorted_rows(expected)).max()
    assert apart <= 1e-5 * np.abs(expected).max()


def sorted_rows(triangles):
    """The sorted corners of sorted triangles, rounded so that the order is that of both."""
    rounded = np.round(triangles, 4) + 0.0
    return np.array(sorted(sorted(map(tuple, corners)) for corners in rounded.tolist()))
