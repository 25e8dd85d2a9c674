"""The Unreal script against a stand-in of Unreal's module; it was never run in Unreal."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest

from tests.acceptance.command import ROOT
from tests.integrations.commands import make_command
from tests.integrations.unreal.unreal_stub import Material, ScopedSlowTask, StaticMesh, make_unreal

SCRIPT = ROOT / "integrations" / "unreal" / "make_occluders.py"
WEDGE = np.array([[0, 0, 0], [300, 0, 0], [0, 200, 0], [0, 0, 100]]) + np.array([50, 25, -400])
FACES = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    return str(make_command(tmp_path_factory.mktemp("bin")))


@pytest.fixture
def wedge():
    return StaticMesh("/Game/Props/Wedge", WEDGE, FACES)


@pytest.fixture
def run(monkeypatch, command):
    """Run the script on a selection: how many it made, and the module that it saw."""

    def with_selection(*selected, arguments=(), command=command):
        unreal = make_unreal(list(selected))
        monkeypatch.setitem(sys.modules, "unreal", unreal)
        spec = importlib.util.spec_from_file_location("make_occluders", SCRIPT)
        script = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(script)
        given = ["--command", command, "--budget", "8", *arguments]
        return script.main(given), unreal

    return with_selection


def test_the_occluder_is_the_last_level_in_the_place_of_the_mesh(run, wedge):
    made, unreal = run(wedge)
    assert (made, unreal.errors, unreal.assets) == (1, [], {})
    vertices, faces = wedge.levels[1]
    assert len(faces) == 4
    distances = np.linalg.norm(vertices[:, None] - WEDGE[None], axis=2)
    np.testing.assert_allclose(distances.min(axis=0), 0.0, atol=1e-3)
    np.testing.assert_allclose(distances.min(axis=1), 0.0, atol=1e-3)
    assert wedge.properties == {"lod_for_occluder_mesh": 1}
    assert wedge.sizes == [1.0, 0.0]
    assert wedge.saved == 1


def test_a_second_run_replaces_that_level_and_no_other(run, wedge):
    wedge.levels.append(wedge.levels[0])
    wedge.sizes.append(0.3)
    run(wedge)
    run(wedge)
    assert len(wedge.levels) == 3
    assert wedge.properties == {"lod_for_occluder_mesh": 2}
    assert wedge.sizes == [1.0, 0.3, 0.0]


def test_what_is_no_static_mesh_is_left_aside(run, wedge):
    assert run(Material(), wedge)[0] == 1
    made, unreal = run(Material())
    assert (made, unreal.warnings) == (0, ["select static meshes in the content browser"])


def test_one_that_fails_is_told_of_by_its_path_and_the_others_are_made(run, wedge):
    empty = StaticMesh("/Game/Props/Empty", np.zeros((3, 3)), [[0, 1, 2]])
    made, unreal = run(empty, wedge)
    assert made == 1
    (error,) = unreal.errors
    assert error.startswith("/Game/Props/Empty.Empty: error: ")
    assert unreal.assets == {}


@pytest.mark.slow
def test_cancel_ends_it_after_the_mesh_under_way(run, wedge, monkeypatch):
    monkeypatch.setattr(ScopedSlowTask, "cancel_after", 1)
    other = StaticMesh("/Game/Other", WEDGE, FACES)
    assert run(wedge, other)[0] == 1
    assert len(other.levels) == 1


def test_a_command_that_is_not_there_is_told(run, wedge):
    made, unreal = run(wedge, command="no-such-occluder")
    assert made == 0
    assert unreal.errors[0].startswith("there is no command 'no-such-occluder'")


@pytest.mark.slow
def test_further_options_reach_the_command(run, wedge):
    made, unreal = run(wedge, arguments=["--options=--preset nonsense"])
    assert made == 0
    assert "preset" in unreal.errors[0]
