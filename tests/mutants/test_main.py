"""The command: what is found, what survives, what hangs and what breaks the process."""

from __future__ import annotations

import gc
import importlib
import os
import sys
from pathlib import Path

import pytest

from tests.mutants import __main__ as command
from tests.mutants.operators import mutants
from tests.mutants.swapping import functions_of, swapped
from tests.mutants.targets import TARGETS, Target

SOURCE = '''\
import os

FLOOR = 2.0


def keep_off(place, wall):
    """Never nearer to a wall than the floor."""
    while place < wall + FLOOR:
        place += 1.0
    return place


def end(code):
    if code > 0:
        return code
    os._exit(3)
'''
TESTS = """\
from {package}.subject import end, keep_off


def test_far_enough():
    assert keep_off(0.0, 1.5) == 4.0
    assert end(1) == 1
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A small project as a target; its tests find some mistakes."""
    package = f"subject_of_{os.getpid()}"
    (tmp_path / package).mkdir()
    (tmp_path / package / "subject.py").write_text(SOURCE)
    (tmp_path / "test_it.py").write_text(TESTS.format(package=package))
    (tmp_path / "pytest.ini").write_text("[pytest]\npythonpath = .\naddopts = -q\n")
    root = str(Path(__file__).parents[2])
    monkeypatch.setenv("PYTHONPATH", f"{root}{os.pathsep}{tmp_path}")
    monkeypatch.chdir(tmp_path)
    return Target(f"{package}/subject.py", ("test_it.py",))


@pytest.mark.slow
def test_survivors_are_told_and_those_that_hang_or_end_the_process_are_caught(project, capsys):
    outcomes = command.run_all([project], processes=2, seconds=1.5)
    found = {
        mutant.after: outcomes[0].found[number]
        for number, mutant in enumerate(mutants(Path(project.file).read_text()))
    }
    assert found == {
        "FLOOR = 0.0": "test_it.py::test_far_enough",
        "while place <= wall + FLOOR:": None,
        "while place < wall - FLOOR:": "test_it.py::test_far_enough",
        "pass": "the time limit",
        "place -= 1.0": "the time limit",
        "place += 0.0": "the time limit",
        "if False:": "the end of its process",
        "if code >= 0:": None,
        "if code > 1:": "the end of its process",
        "os._exit(4)": None,
    } | {"pass": found["pass"]}
    assert command.report(outcomes, {}) == 1
    told = capsys.readouterr().out
    assert "while place < wall + FLOOR:\n    + while place <= wall + FLOOR:" in told
    equivalents = {
        (project.file, one.function, one.before, one.after, one.number): "so be it"
        for number, one in enumerate(mutants(Path(project.file).read_text()))
        if outcomes[0].found[number] is None
    }
    assert command.report(outcomes, equivalents) == 0
    table = capsys.readouterr().out.splitlines()
    assert table[-1].split() == ["in", "all", "11", "7", "4", "0", "0"]
    no_survivor = {(project.file, "end", "if code > 0:", "if False:", 1): "it was found"}
    assert command.report(outcomes, equivalents | no_survivor) == 1
    assert "no survivor" in capsys.readouterr().out


def test_tests_that_fail_by_themselves_are_no_verdict(project, capsys):
    Path("test_it.py").write_text("def test_wrong():\n    assert False\n")
    assert command.report(command.run_all([project], processes=1, seconds=60.0), {}) == 1
    assert "test_wrong" in capsys.readouterr().out


def test_a_mutant_is_seen_by_those_who_imported_its_original_and_leaves_no_trace(project, tmp_path):
    sys.path.insert(0, str(tmp_path))
    try:
        subject = __import__(project.file.partition("/")[0] + ".subject").subject
    finally:
        sys.path.remove(str(tmp_path))
    imported = subject.keep_off
    functions = functions_of(str(subject.__file__))
    results = set()
    for mutant in mutants(SOURCE):
        if "FLOOR" in mutant.after:
            with swapped(mutant, subject, functions) as changed:
                assert changed
                results.add(imported(4.0, 1.5))
                results.add(imported(3.5, 1.5))
    assert {3.5, 4.0, 4.5} <= results
    assert imported(3.5, 1.5) == 3.5
    assert imported(0.0, 1.5) == 4.0


def test_what_is_remembered_of_a_mutant_is_forgotten(tmp_path, monkeypatch):
    """A mutant of a function that remembers survived, and one that was called failed all others."""
    source = "from functools import cache\n\n\n@cache\ndef twice(one):\n    return 2 * one\n"
    name = f"remembering_of_{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    subject = importlib.import_module(name)
    assert subject.twice(5) == 10
    results = set()
    for mutant in mutants(source):
        with swapped(mutant, subject, functions_of(str(subject.__file__))):
            results.add(subject.twice(5))
        assert subject.twice(5) == 10
    assert 15 in results


def test_functions_are_found_though_all_that_was_collected_is_frozen():
    """Else no mutant is ever put in, and each of them survives."""
    gc.freeze()
    assert functions_of in functions_of(functions_of.__code__.co_filename)


def test_what_is_listed_is_there():
    for target in TARGETS:
        assert Path(target.file).is_file()
        assert all(Path(test.partition("::")[0]).is_file() for test in target.tests)
    files = {target.file for target in TARGETS}
    there = {(file, *one.key) for file in files for one in mutants(Path(file).read_text())}
    there |= {(file, function, before, None, 1) for file, function, before, _, _ in there}
    for key, reason in command.read_equivalents().items():
        assert key in there
        assert reason


def test_words_that_no_target_holds_are_an_error(capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(["--only", "nowhere"])
    assert ended.value.code == 2
    assert "no target's file holds any of: nowhere" in capsys.readouterr().err
