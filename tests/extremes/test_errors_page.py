"""Every refusal is listed in the docs as it is raised, and says what to do."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import simplifier
from simplifier import errors
from tests.acceptance.command import ROOT
from tests.extremes import refusals

PAGE = ROOT / "docs" / "errors.md"
TELL = "write what `python -m tests.extremes.refusals` prints into docs/errors.md"
KINDS = {kind.__name__: kind for kind in refusals.library_errors()}


def test_every_error_of_the_library_has_an_example():
    assert set(refusals.library_errors()) == {errors.OccluderError, *refusals.LIBRARY}


@pytest.mark.parametrize("kind", refusals.LIBRARY, ids=lambda kind: kind.__name__)
def test_an_example_is_of_its_kind_and_says_what_to_do(kind):
    error = refusals.raised(kind)
    assert type(error) is kind
    assert error.remedy or kind is errors.CancelledError
    assert str(error).endswith(error.remedy)


def test_the_table_of_the_library_is_current():
    assert refusals.library_table() in PAGE.read_text(), TELL


def test_the_table_of_the_service_is_current():
    assert refusals.service_table() in PAGE.read_text(), TELL


def test_what_users_catch_is_exported():
    hidden = {
        "UnreadablePathError",
        "CommandError",
        "ManifestError",
    }  # of files and commands beside the pipeline
    assert set(KINDS) - hidden <= set(simplifier.__all__)


def raised_in(path: Path, module: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    """The library's own errors that a module makes, with the place."""
    for node in ast.walk(module):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in KINDS:
            yield f"{path.relative_to(ROOT)}:{node.lineno}", node


@cache
def parsed() -> list[tuple[Path, ast.Module]]:
    """The modules whose text makes an error of the library; to parse all takes seconds."""
    kinds = "|".join(KINDS)
    named = re.compile(rf"\b({kinds})\s*\(|\braise\s+({kinds})\b")
    texts = ((path, path.read_text()) for path in sorted((ROOT / "simplifier").rglob("*.py")))
    return [(path, ast.parse(text)) for path, text in texts if named.search(text)]


@cache
def made() -> list[tuple[str, ast.Call]]:
    return [one for path, module in parsed() for one in raised_in(path, module)]


def test_errors_are_found():
    assert len(made()) > 80


def test_no_error_is_made_without_a_word_on_what_to_do():
    silent = [
        place
        for place, call in made()
        if not any(keyword.arg == "remedy" for keyword in call.keywords)
        and not KINDS[call.func.id].usual_remedy
        and call.func.id != "CancelledError"
    ]
    assert silent == []


def test_no_error_is_made_without_a_sentence():
    """What is wrong, in words: not the name of a thing alone."""
    for place, call in made():
        what = call.args[0]
        if isinstance(what, ast.Constant):
            assert len(what.value.split()) >= 3, place


def test_no_bare_error_of_the_library_is_raised():
    for path, module in parsed():
        for node in ast.walk(module):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Name):
                assert node.exc.id not in KINDS, f"{path}:{node.lineno}"
