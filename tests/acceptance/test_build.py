"""``occluder build`` as its users run it: by hand, in CI, interrupted, on a service."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import xml.etree.ElementTree as ET

import pytest

import simplifier
from service.client import Client, Priority
from tests import solids
from tests.acceptance.command import OCCLUDER, ROOT, environment, occluder
from tests.git import git
from tests.service.declared import declare
from tests.service.real import running
from tests.waiting import until

pytestmark = pytest.mark.usefixtures("making_here")
"""Of builds by the command in this process; others start what they start."""

QUICK = """
[defaults]
preset = "draft"
resolution = 12
moves = 40
views = 4
image = 32

[[asset]]
files = "props/*.ply"
"""
LONG = QUICK.replace("moves = 40", "moves = 100000000")


def save(mesh, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), path)


@pytest.fixture
def folder(tmp_path):
    """Three meshes and their manifest."""
    (tmp_path / "occluders.toml").write_text(QUICK)
    save(solids.box(), tmp_path / "props/box.ply")
    save(solids.torus(), tmp_path / "props/torus.ply")
    save(solids.sphere(), tmp_path / "props/ball.ply")
    return tmp_path


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob("*") if path.is_file()}  # fmt: skip


def test_it_builds_checks_and_reports(folder, here):
    stale = occluder("build", "--check", cwd=folder)
    assert stale.returncode == 1
    assert "error: props/box.ply: stale: it was never made" in stale.stderr
    assert set(contents(folder)) == {"occluders.toml"} | {
        f"props/{name}.ply" for name in ("box", "torus", "ball")
    }
    done = occluder("build", "--junit", "j.xml", "--markdown", "m.md", "--json", "j.json",
                    cwd=folder)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "3 assets: 3 built" in done.stdout
    assert len(ET.parse(folder / "j.xml").findall(".//testcase")) == 3
    assert "| props/torus.ply | ✅ |" in (folder / "m.md").read_text()
    figures = {one["asset"]: one["figures"] for one in json.loads((folder / "j.json").read_text())
               ["assets"]}  # fmt: skip
    mesh, made = (simplifier.load(folder / "props" / name)
                  for name in ("torus.ply", "torus_occluder.glb"))  # fmt: skip
    assert figures["props/torus.ply"]["triangles"] == len(made.faces)
    measured = simplifier.evaluate(
        mesh, simplifier.Occluder(made.vertices, made.faces), views=4, image=32
    ).accuracy
    assert figures["props/torus.ply"]["recall"] == pytest.approx(measured.recall, abs=1e-6)
    check = here("build", "--check", cwd=folder)
    assert (check.returncode, check.stdout) == (0, "3 assets: 3 current\n")
    alone = here(
        "simplify", "props/torus.ply", "-o", "alone.glb", "--preset", "draft", "--resolution", "12",
        "--moves", "40", cwd=folder,
    )  # fmt: skip
    assert alone.returncode == 0, alone.stderr
    assert contents(folder)["alone.glb"] == contents(folder)["props/torus_occluder.glb"]


def test_overhang_and_a_verdict_can_be_required(folder, here):
    """The verdict of four views of 32 pixels counts as any other."""
    manifest = folder / "occluders.toml"
    kept = "require = { max_overhang = 1.0, verdict = 'weak' }\n"
    manifest.write_text(QUICK + kept)
    done = here("build", "--json", "j.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    assets = json.loads((folder / "j.json").read_text())["assets"]
    figures = {one["asset"]: one["figures"] for one in assets}
    assert {one["verdict"] for one in figures.values()} <= {"good", "weak"}
    assert "verdict" in done.stdout
    assert "overhang" in done.stdout
    manifest.write_text(QUICK + "budget = 2\n" + kept)
    done = here("build", cwd=folder)
    assert done.returncode == 1
    assert "error: props/torus.ply: the verdict is unusable, not weak\n" in done.stderr
    assert "warning: props/torus.ply: unusable: it hides " in done.stderr
    manifest.write_text(QUICK + "overhang = 0.5\nrequire = { max_overhang = 0.0001 }\n")
    done = here("build", cwd=folder)
    assert done.returncode == 1
    assert "error: props/ball.ply: overhang " in done.stderr
    assert " is above 0.01 %\n" in done.stderr
    again = here("build", "--check", cwd=folder)
    assert again.returncode == 1
    assert " is above 0.01 %\n" in again.stderr


def test_lost_recall_is_refused_against_a_revision_and_a_record(folder, here):
    assert here("build", cwd=folder).returncode == 0
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "occluders")
    (folder / "before.lock").write_bytes((folder / "occluders.lock").read_bytes())
    assert here("build", "--check", "--against", "HEAD", cwd=folder).returncode == 0
    (folder / "occluders.toml").write_text(QUICK + "budget = 2\n")
    assert here("build", cwd=folder).returncode == 0  # nothing requires more
    for before in ("HEAD", "before.lock"):
        done = here("build", "--check", "--against", before, cwd=folder)
        assert done.returncode == 1
        assert "error: props/torus.ply: recall " in done.stderr
    git(folder, "commit", "-q", "-a", "-m", "fewer triangles")
    assert here("build", "--check", "--against", "HEAD", cwd=folder).returncode == 0


def test_a_check_loads_nothing_that_makes_occluders(folder, here):
    assert here("build", cwd=folder).returncode == 0
    code = (
        "import sys\nfrom simplifier.cli import main\nsys.argv = ['occluder', 'build', '--check',"
        " '--junit', 'j.xml', '--markdown', 'm.md', '--json', 'j.json']\n"
        "try:\n    main.main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "print({'numpy', 'numba', 'scipy', 'watchfiles'} & set(sys.modules))"
    )
    done = subprocess.run(
        [os.sys.executable, "-c", code], cwd=folder, env=environment(), capture_output=True,
        text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.endswith("set()\n")


def test_one_that_fails_is_named_and_the_others_are_made(folder, here):
    (folder / "props/broken.ply").write_bytes(b"ply\nformat ascii 1.0\n")
    done = here("build", cwd=folder)
    assert done.returncode == 1
    assert "error: props/broken.ply: failed: " in done.stderr
    assert "4 assets: 3 built, 1 failed" in done.stdout
    assert "Traceback" not in done.stderr


def test_a_bad_manifest_is_one_line_with_file_and_line(folder, here):
    (folder / "occluders.toml").write_text(QUICK + "budgte = 3\n")
    for command in (("build",), ("build", "--check")):
        done = here(*command, cwd=folder)
        assert done.returncode == 1
        assert done.stderr == (
            "error: occluders.toml:11: 'budgte' is not known; did you mean 'budget'?\n"
        )


@pytest.mark.slow
def test_an_interrupted_build_says_so_and_goes_on(folder, here):
    (folder / "occluders.toml").write_text(LONG + "[[asset]]\nfiles='props/box.ply'\nmoves = 40\n")
    with subprocess.Popen(
        [*OCCLUDER, "build", "--at-once", "2"], cwd=folder, env=environment(), text=True,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as process:  # fmt: skip
        until((folder / "occluders.lock").exists, 60.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "interrupted; what was made is kept" in errors
    assert "Traceback" not in errors
    made = {name for name in contents(folder) if "occluder" in name}
    assert made == {"occluders.toml", "occluders.lock", "props/box_occluder.glb"}
    (folder / "occluders.toml").write_text(QUICK)
    done = here("build", cwd=folder)
    assert done.returncode == 0
    assert "3 assets: 1 current, 2 built" in done.stdout


def test_a_killed_build_leaves_no_half_file_and_goes_on(folder, here):
    """While it runs a second one is refused."""
    (folder / "occluders.toml").write_text(LONG + "[[asset]]\nfiles='props/box.ply'\nmoves = 40\n")
    with subprocess.Popen(
        [*OCCLUDER, "build", "--at-once", "2"], cwd=folder, env=environment(),
        stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        until((folder / "occluders.lock").exists, 60.0)
        second = occluder("build", cwd=folder)
        process.kill()
    assert second.returncode == 1
    assert "another build of this folder is running; wait for its end" in second.stderr
    lock = ".occluder-build.lock"  # whose holder is gone
    made = {name for name in contents(folder) if "occluder" in name}
    assert made == {lock, "occluders.toml", "occluders.lock", "props/box_occluder.glb"}
    simplifier.load_occluder(folder / "props/box_occluder.glb")
    (folder / "occluders.toml").write_text(QUICK)
    assert "3 assets: 1 current, 2 built" in here("build", cwd=folder).stdout
    assert lock not in contents(folder)


BY_HAND = """
[[quad]]
name = "wall"
corners = [[-3, -1, 0], [3, -1, 0], [3, 1, 0], [-3, 1, 0]]
"""
IN_MANY_WAYS = (
    QUICK
    + """
[[asset]]
files = "props/box.ply"
output = [
  "{folder}/{name}.tres",
  { file = "{folder}/{name}.obj", sides = "single", as_quads = true },
  { file = "whole/{name}.glb", with_original = "godot" },
]
"""
)


def test_overrides_beside_a_mesh_are_kept_and_are_followed(folder, here):
    for name in ("torus", "ball"):
        (folder / f"props/{name}.ply").unlink()
    assert here("build", cwd=folder).returncode == 0
    by_hand = folder / "props/box.overrides.toml"
    by_hand.write_text(BY_HAND)
    check = here("build", "--check", cwd=folder)
    assert "error: props/box.ply: stale: 'box.overrides.toml' has changed" in check.stderr
    done = here("build", cwd=folder)
    assert "1 asset: 1 built" in done.stdout, done.stderr
    assert "warning: props/box.ply: wall (props/box.overrides.toml:2) sticks out" in done.stderr
    made = simplifier.load_occluder(folder / "props/box_occluder.glb")
    assert abs(made.vertices[:, 0]).max() == 3.0
    by_hand.write_text(BY_HAND.replace("corners", "corner"))
    bad = here("build", cwd=folder)
    assert bad.returncode == 1
    assert "box.overrides.toml:4: there is no key 'corner' in [[quad]]; choose from" in bad.stderr
    assert abs(simplifier.load_occluder(folder / "props/box_occluder.glb").vertices).max() == 3.0


def test_an_asset_is_written_in_many_ways(folder, here):
    for name in ("torus", "ball"):
        (folder / f"props/{name}.ply").unlink()
    (folder / "occluders.toml").write_text(IN_MANY_WAYS)
    assert here("build", cwd=folder).returncode == 0
    plain = simplifier.load_occluder(folder / "props/box.tres")
    quads = (folder / "props/box.obj").read_text().splitlines()
    corners = [len(line.split()) - 1 for line in quads if line.startswith("f ")]
    assert 4 in corners
    assert sum(count - 2 for count in corners) >= len(plain.faces)
    whole = gltf_json(folder / "whole/box.glb")
    assert [node["name"] for node in whole["nodes"]] == ["box", "box-occonly"]
    assert here("build", "--check", cwd=folder).returncode == 0
    once = contents(folder)
    (folder / "occluders.toml").write_text(IN_MANY_WAYS.replace('"godot"', '"lod"'))
    check = here("build", "--check", cwd=folder)
    assert "'whole/box.glb': with_original was godot and is lod" in check.stderr
    assert here("build", cwd=folder).returncode == 0
    changed = {name for name, data in contents(folder).items() if once[name] != data}
    assert changed == {"occluders.toml", "occluders.lock", "whole/box.glb"}


def gltf_json(path):
    data = path.read_bytes()
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


SERVED = (
    QUICK
    + """
[[asset]]
files = "props/torus.ply"
lods = 2
output = ["{folder}/{name}_occluder.glb", "made/{name}.tres"]

[[asset]]
files = "props/ball.ply"
conservative = true
output = "made/{name}.obj"
"""
)


@pytest.mark.slow
def test_a_service_makes_the_same_bytes(folder, here, tmp_path_factory):
    declared = os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])
    (folder / "occluders.toml").write_text(SERVED)
    (folder / "props/torus.overrides.toml").write_text(BY_HAND)
    local = tmp_path_factory.mktemp("local")
    for name, data in contents(folder).items():
        (local / name).parent.mkdir(exist_ok=True)
        (local / name).write_bytes(data)
    assert here("build", cwd=local).returncode == 0
    with running(declared, tmp_path_factory.mktemp("served") / "data") as server:
        (folder / "props/broken.ply").write_bytes(b"ply\nformat ascii 1.0\n")
        done = occluder(
            "build", "--server", server.address, cwd=folder, timeout=400, PYTHONPATH=declared
        )
        assert done.returncode == 1
        assert "4 assets: 3 built, 1 failed" in done.stdout, done.stderr
        assert "error: props/broken.ply: failed: " in done.stderr
        with Client(server.address) as client:  # a build lets people go first
            assert {job.priority for job in client.jobs()} == {Priority.BULK}
        (folder / "props/broken.ply").unlink()
        check = occluder("build", "--check", cwd=folder)
        assert check.returncode == 0, check.stderr
    assert contents(folder) == contents(local)


def test_a_service_that_is_not_there_is_said_asset_by_asset(folder, tmp_path_factory):
    declared = os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])
    done = occluder("build", "--server", "gopher://x", cwd=folder, PYTHONPATH=declared)
    assert done.returncode == 2
    assert "'gopher://x' is not an address of a service; write as in http" in done.stderr


@pytest.mark.parametrize("option", ["--json", "--junit", "--markdown"])
def test_a_report_takes_the_place_of_nothing_that_a_build_reads_or_writes(folder, here, option):
    """A report took the place of a mesh, and the status was 0."""
    assert here("build", cwd=folder).returncode == 0
    before = contents(folder)
    assert "props/box_occluder.glb" in before
    for name in (*before, "props/ball.overrides.toml"):
        done = here("build", option, name, cwd=folder)
        assert done.returncode == 1, name
        assert f"error: {name}: this is " in done.stderr
        assert "name another file for the report" in done.stderr
    assert contents(folder) == before
