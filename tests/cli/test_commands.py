"""Commands from other packages: a folder on the path with metadata is all that they need."""

from __future__ import annotations

import inspect
import subprocess
import sys

import pytest
import typer

from simplifier.cli.main import OWN, app
from tests.acceptance.command import ROOT, environment, occluder

METADATA = "Metadata-Version: 2.1\nName: planar-serving\nVersion: 1.0\n"

ENTRY_POINTS = """[occluder.commands]
host = serving.commands:host
badges = serving.badges:app
broken = serving.nowhere:command
later = serving.listed:later
missing = serving.listed:missing
simplify = serving.commands:thief
"""

COMMANDS = '''
import simplifier
from simplifier.cli.plugin import run_guarded
print("serving is imported")

def host(port: int = 8000, busy: bool = False) -> None:
    """Answer over HTTP."""
    def run():
        if busy:
            raise simplifier.OutputError("it is taken", where=f"port {port}", remedy="use another")
        print("served on", port)
    run_guarded(run, debug=False)

def thief() -> None:
    """Be in the way of another command."""
    print("stolen")
'''

BADGES = '''
import typer
app = typer.Typer(add_completion=False, help="Badges of guests.")

@app.command()
def add(name: str) -> None:
    """Make a badge."""
    print("added", name)

@app.command("list")
def show() -> None:
    """Show all badges."""
    print("no badges")
'''

LISTED = """
from simplifier.cli.lazy import LazyCommand
later = LazyCommand("serving.commands:host", "Answer later.")
missing = LazyCommand("serving.commands:guest", "Be missing.")
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A place for ``PYTHONPATH`` with a package that adds commands."""
    place = tmp_path_factory.mktemp("site")
    for name, text in {
        "planar_serving-1.0.dist-info/METADATA": METADATA,
        "planar_serving-1.0.dist-info/entry_points.txt": ENTRY_POINTS,
        "serving/__init__.py": "",
        "serving/commands.py": COMMANDS,
        "serving/badges.py": BADGES,
        "serving/listed.py": LISTED,
    }.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(text)
    return f"{place}:{ROOT}"


@pytest.fixture
def run(path):
    """Exit status, output and errors of ``occluder`` with that package installed."""

    def start(*arguments):
        done = occluder(*arguments, PYTHONPATH=path, COLUMNS="120")
        return done.returncode, done.stdout, done.stderr

    return start


def test_a_command_from_outside_runs(run):
    assert run("host", "--port", "9") == (0, "serving is imported\nserved on 9\n", "")


def test_a_group_of_commands_runs(run):
    assert run("badges", "add", "me") == (0, "added me\n", "")
    assert run("badges", "list") == (0, "no badges\n", "")


def test_failures_are_those_of_every_command(run):
    status, _, errors = run("host", "--port", "9", "--busy")
    assert (status, errors) == (1, "error: port 9: it is taken; use another\n")
    status, _, errors = run("host", "--port", "many")
    assert status == 2
    assert errors.startswith("error: Invalid value for '--port'")


def test_the_help_shows_them_and_one_line_for_one_that_is_broken(run):
    status, output, errors = run("--help")
    assert status == 0
    for words in ("simplify", "Make an occluder from a mesh", "host", "Answer over HTTP."):
        assert words in output
    assert "Badges of guests." in output
    assert "Be in the way" not in output
    assert "broken" not in output
    assert errors.startswith("warning: command 'broken' of planar-serving: cannot be loaded (Modul")
    assert errors.count("\n") == 1


def test_one_that_is_broken_is_one_line(run):
    status, output, errors = run("broken")
    assert (status, output) == (1, "")
    assert errors.startswith("error: command 'broken' of planar-serving: cannot be loaded")
    assert errors.endswith("; mend or remove planar-serving\n")
    assert errors.count("\n") == 1


def test_a_lazy_command_is_listed_by_its_words_and_runs_as_any_other(run):
    _, output, _ = run("--help")
    assert "Answer later." in output
    assert run("later", "--port", "9") == (0, "serving is imported\nserved on 9\n", "")


def test_a_lazy_command_that_is_missing_is_one_line(run):
    status, output, errors = run("missing")
    assert (status, output) == (1, "serving is imported\n")
    assert errors.startswith("error: command 'missing' of planar-serving: cannot be loaded (Attr")
    assert errors.count("\n") == 1


def test_an_unknown_command_is_wrong_usage(run):
    status, _, errors = run("hosts")
    assert status == 2
    assert "No such command 'hosts'. Did you mean 'host'?" in errors


LOADED = """
import sys
from importlib.metadata import MetadataPathFinder
from simplifier.cli import main

searched = []
find = MetadataPathFinder.find_distributions
MetadataPathFinder.find_distributions = lambda *a, **k: searched.append(a) or find(*a, **k)
sys.argv = ["occluder", *sys.argv[1:]]
try:
    main.main()
except SystemExit:
    pass
print("serving" in sys.modules, bool(searched), "numpy" in sys.modules)
"""


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (("simplify", "none.obj", "-o", "o.glb"), "False False True"),
        (("--version",), "False False False"),
        (("host",), "True True False"),
        (("badges", "list"), "True True False"),
    ],
)
def test_nothing_is_loaded_that_is_not_asked_for(path, tmp_path, arguments, found):
    """The package from outside, the search for it, and numpy."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED, *arguments],
        env=environment(PYTHONPATH=path), cwd=tmp_path, capture_output=True, text=True, timeout=60,
        check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == found


@pytest.mark.parametrize("name", OWN)
def test_the_list_says_of_a_command_what_its_own_help_says(name):
    whole = inspect.cleandoc(OWN[name].load().__doc__)
    assert " ".join(whole.partition("\n\n")[0].split()) == OWN[name].help


LISTED_ALONE = """
import sys
from simplifier.cli.main import main
sys.argv = ["occluder", "--help"]
try:
    main()
finally:
    print([name for name in ("numpy", "statistics") if name in sys.modules])
    print([name for name in sys.modules if "service." in name])
"""


def test_the_list_loads_none_of_them():
    done = subprocess.run(
        [sys.executable, "-c", LISTED_ALONE],
        env=environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "pvs-check" in done.stdout
    assert done.stdout.endswith("[]\n['service.cli', 'service.cli.commands']\n")


def test_a_line_needs_nothing_that_draws_tables():
    code = "import sys; from simplifier.cli.main import main; sys.argv[1:] = ['--version']\n" \
           "try: main()\nfinally: print('rich.console' in sys.modules)"  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True
    )
    assert done.stdout.endswith("False\n")


def test_options_are_read_without_pydantic():
    code = "import sys; from simplifier.cli.main import main\n" \
           "sys.argv = ['occluder', 'simplify', 'none.obj', '-o', 'o.glb', '--budget', '8']\n" \
           "try: main()\nfinally: print('pydantic' in sys.modules)"  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True
    )
    assert "there is no such file" in done.stderr
    assert done.stdout.endswith("False\n")


@pytest.mark.parametrize("name", sorted(OWN))
def test_every_own_command_can_be_quiet(name):
    found = typer.main.get_command(app).get_command(None, name)
    assert any("--quiet" in parameter.opts for parameter in found.params)
