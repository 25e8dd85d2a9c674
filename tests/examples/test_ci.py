"""The CI example on a real repository, and the hooks for pre-commit."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import tomllib

import pytest
import yaml

import simplifier
from simplifier.io.suffixes import MESH_SUFFIXES
from tests import solids
from tests.acceptance.command import ROOT, environment
from tests.git import git
from tests.integrations.commands import make_command

SCRIPT = ROOT / "examples" / "ci" / "check_occluders.sh"
MANIFEST = """
[defaults]
resolution = 16
moves = 200
views = 16
image = 64
budget = {budget}

[[asset]]
files = "*.ply"
require = {{ max_recall_loss = {loss} }}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A PATH on which ``occluder`` is this checkout's."""
    command = make_command(tmp_path_factory.mktemp("bin"))
    return os.pathsep.join([str(command.parent), os.environ["PATH"]])


@pytest.fixture
def change(here):
    """``change(folder, budget)``: write a manifest, build, commit."""

    def make(folder, budget, loss=0.005):
        (folder / "occluders.toml").write_text(MANIFEST.format(budget=budget, loss=loss))
        done = here("build", cwd=folder)
        assert done.returncode == 0, done.stderr
        git(folder, "add", ".")
        git(folder, "commit", "-q", "-m", "a change")

    return make


@pytest.fixture
def repository(change, tmp_path):
    """Of one mesh with its occluder, on the branch main."""
    mesh = solids.torus()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), tmp_path / "torus.ply")
    (tmp_path / ".gitignore").write_text("occluders.xml\noccluders.md\n")
    git(tmp_path, "init", "-q", "-b", "main")
    change(tmp_path, 64)
    git(tmp_path, "checkout", "-q", "-b", "change")
    return tmp_path


def checked(folder, path):
    return subprocess.run(
        [SCRIPT, "main"], cwd=folder, env=environment(PATH=path, GITHUB_STEP_SUMMARY=None),
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_a_change_that_lowers_recall_fails_and_one_that_says_so_passes(repository, change, path):
    change(repository, 2)
    done = checked(repository, path)
    assert done.returncode == 1
    assert "error: torus.ply: recall fell from " in done.stderr
    assert "| torus.ply | ❌ | unusable | 2 |" in (repository / "occluders.md").read_text()
    assert 'failures="1"' in (repository / "occluders.xml").read_text()
    change(repository, 2, loss=1.0)
    done = checked(repository, path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_change_that_hides_as_much_passes_and_a_stale_one_fails(repository, change, path):
    change(repository, 72)
    done = checked(repository, path)
    assert done.returncode == 0, done.stderr
    (repository / "occluders.toml").write_text(MANIFEST.format(budget=80, loss=0.005))
    done = checked(repository, path)
    assert done.returncode == 1
    assert "error: torus.ply: stale: budget was 72 and is 80" in done.stderr


def test_the_workflow_runs_the_script_with_the_branch_that_the_change_goes_into():
    workflow = yaml.safe_load((SCRIPT.parent / "occluders.yml").read_text())
    steps = workflow["jobs"]["check"]["steps"]
    commands = [step["run"] for step in steps if "run" in step]
    assert commands[-1].startswith(f"ci/{SCRIPT.name} ")
    assert steps[0]["with"]["fetch-depth"] == 0


HOOKS = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
SCRIPTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
PRE_COMMIT = shutil.which("pre-commit")


def test_hooks_have_what_pre_commit_asks_for():
    assert [hook["id"] for hook in HOOKS] == ["occluder-build-check", "occluder-build"]
    for hook in HOOKS:
        assert {"id", "name", "entry", "language"} <= set(hook)
        assert hook["pass_filenames"] is False
        assert shlex.split(hook["entry"])[0] in SCRIPTS


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
@pytest.mark.parametrize("suffix", [*MESH_SUFFIXES, ".bin", ".mtl", ".lock", ".overrides.toml"])
def test_a_hook_sees_all_that_a_check_depends_on(hook, suffix):
    assert re.search(hook["files"], f"art/castle{suffix}")


@pytest.mark.skipif(not PRE_COMMIT, reason="pre-commit is not installed")
def test_pre_commit_runs_the_hooks(repository, path, tmp_path_factory):
    hooks = tmp_path_factory.mktemp("hooks")
    shutil.copy(ROOT / ".pre-commit-hooks.yaml", hooks)
    git(hooks, "init", "-q", "-b", "main")
    git(hooks, "add", ".")
    git(hooks, "commit", "-q", "-m", "hooks")
    used = [{"id": hook["id"], "language": "system"} for hook in HOOKS]
    config = {"repos": [{"repo": str(hooks), "rev": "main", "hooks": used}]}
    (repository / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    git(repository, "add", ".")
    home = str(tmp_path_factory.mktemp("pre-commit"))

    def runs(hook):
        done = subprocess.run(
            [PRE_COMMIT, "run", hook, "--all-files", "--color", "never"], cwd=repository,
            env=environment(PATH=path, PRE_COMMIT_HOME=home), capture_output=True, text=True,
            timeout=120, check=False,
        )  # fmt: skip
        return done.returncode, done.stdout

    assert runs("occluder-build-check")[0] == 0
    (repository / "occluders.toml").write_text(MANIFEST.format(budget=32, loss=0.005))
    status, said = runs("occluder-build-check")
    assert status == 1
    assert "error: torus.ply: stale: budget was 64 and is 32" in said
    git(repository, "add", ".")
    status, said = runs("occluder-build")
    assert status == 1
    assert "files were modified by this hook" in said
    git(repository, "add", ".")
    assert [runs(hook["id"])[0] for hook in HOOKS] == [0, 0]


@pytest.mark.sweep(2)
@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_fails_where_something_is_wrong(hook, repository, path):
    command = shlex.split(hook["entry"])
    good = subprocess.run(command, cwd=repository, env=environment(PATH=path), check=False)
    assert good.returncode == 0
    (repository / "torus.ply").write_bytes(b"ply\n")
    bad = subprocess.run(command, cwd=repository, env=environment(PATH=path), check=False)
    assert bad.returncode == 1
