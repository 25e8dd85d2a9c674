"""Every command of the README and the tutorial, as it stands there.

They run in the folder that ``make demo`` makes.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.main import get_command

from simplifier.cli.main import app
from tests.acceptance.command import ROOT, environment
from tests.conftest import ASSETS

README = (ROOT / "README.md").read_text(encoding="utf-8")
TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS, TUTORIAL_BLOCKS = (
    re.findall(r"^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL) for page in (README, TUTORIAL)
)
PROMISED = re.findall(r"^```text\n(.*?)^```", TUTORIAL, re.MULTILINE | re.DOTALL)
ROWS = re.findall(r"^```console\n(.*?)^```", README, re.MULTILINE | re.DOTALL)[0].splitlines()
BIN = Path(sys.executable).parent


def commands(block: str) -> list[str]:
    """Its lines, each with those that it goes on in, without remarks."""
    lines = block.replace("\\\n", " ").splitlines()
    return [line.partition("  #")[0].strip() for line in lines]


def is_of_the_demo(block: str) -> bool:
    """Whether it is run in the demo's folder; a server's are tested where a server is."""
    return not block.startswith(("make ", "cd ", "occluder serve"))


COMMANDS, TUTORIAL_COMMANDS = (
    [one for block in blocks if is_of_the_demo(block) for one in commands(block)]
    for blocks in (BLOCKS, TUTORIAL_BLOCKS)
)
_NUMBER = re.compile(r"\d[\d,.]*\d|\d")


def test_the_readme_begins_with_what_it_is_for_and_two_commands():
    picture, _, rest = README.partition("\n# planar-occluder\n\n")
    assert "docs/images/culling.png" in picture
    sentences = rest.partition("```sh")[0]
    assert len(re.findall(r"[.:](?=\s)", sentences)) <= 3
    assert [one.split()[:2] for one in commands(BLOCKS[0])] == [["make", "demo"], ["make", "test"]]


@pytest.mark.parametrize("typed", [*COMMANDS, *TUTORIAL_COMMANDS, *ROWS])
def test_each_command_is_one_that_there_is(typed):
    program, name, *arguments = shlex.split(typed)
    assert program == "occluder"
    command = get_command(app).commands[name]
    command.make_context(name, arguments)  # raises for an option that there is not


def test_each_row_of_the_table_has_its_command():
    rows = re.findall(r"^\| (\w+) \| [\d,]+ → (\d+) \|", README, re.MULTILINE)
    assert [(name, budget) for name, budget in rows] == [
        (Path(shlex.split(typed)[4]).stem, re.search(r"--budget (\d+)", typed)[1]) for typed in ROWS
    ]


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """What ``make demo`` makes, by the commands of the Makefile, in an empty folder."""
    place = tmp_path_factory.mktemp("demo")
    (place / "examples").symlink_to(ROOT / "examples")
    told = subprocess.run(
        ["make", "--no-print-directory", "-n", "demo", f"BIN={BIN}", "COMMAND="],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    run(told, place)
    return place / "out" / "demo"


def run(script, folder):
    path = f"{BIN}:{environment()['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-c", script], cwd=folder, env=environment(PATH=path),
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{script}\n{done.stderr}"
    return done.stdout


@pytest.mark.slow
def test_every_command_runs_as_it_stands_there(demo):
    assert (demo / "report.html").is_file()
    for typed in COMMANDS:
        run(typed, demo)
    shown, drawn = (
        np.asarray(Image.open(path).convert("RGB"), dtype=int)
        for path in (ROOT / "docs" / "images" / "castle.png", demo / "best" / "silhouettes.png")
    )
    differs = np.abs(shown - drawn).max(axis=2) > 64
    assert differs.mean() < 0.002  # the picture of an earlier search differed in 3 % of the pixels


def test_the_tutorial_shows_what_its_first_command_prints(tmp_path):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    run("python -m examples.castle castle.glb", tmp_path)
    assert_shown(run(TUTORIAL_COMMANDS[0], tmp_path), PROMISED[0])


@pytest.mark.slow
def test_the_tutorial_shows_what_its_commands_print(demo):
    assert_shown("".join(run(typed, demo) for typed in TUTORIAL_COMMANDS), "".join(PROMISED))


def assert_shown(printed, promised):
    """Lines are the same but for their numbers, which are within a fiftieth."""
    for line in promised.splitlines():
        alike = [
            one for one in printed.splitlines() if _NUMBER.sub("#", one) == _NUMBER.sub("#", line)
        ]
        assert any(numbers(one) == pytest.approx(numbers(line), rel=0.02) for one in alike), line


def numbers(line):
    return [float(one.replace(",", "")) for one in _NUMBER.findall(line)]


@pytest.mark.slow
def test_the_example_in_python_runs(demo):
    (example,) = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    (demo / "example.py").write_text(example)
    assert "recall" in run("python example.py", demo)


@pytest.mark.slow
@pytest.mark.parametrize("typed", ROWS, ids=[shlex.split(row)[4] for row in ROWS])
def test_each_row_is_what_its_command_gives(typed, tmp_path):
    words = shlex.split(typed)
    mesh = ASSETS / words[2]
    if not mesh.exists():
        pytest.skip(f"{mesh.name} is not there")
    shutil.copy(mesh, tmp_path)
    shown = run(typed, tmp_path)
    row = next(
        line for line in README.splitlines() if line.startswith(f"| {Path(words[4]).stem} |")
    )
    recall = re.search(r"\*\*([\d.]+) %\*\*", row)[1]
    assert float(re.search(r"recall +│ +([\d.]+) %", shown)[1]) == pytest.approx(
        float(recall), abs=0.15
    )
