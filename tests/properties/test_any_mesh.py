"""Any mesh with any options: an occluder that keeps its promises, or a refusal.

What is looked at is in ``tests/fuzz/promises``; the fuzzer goes on from here with more of the same.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from simplifier import OptionError, SimplifyOptions
from tests.fuzz.cases import write_case
from tests.fuzz.targets import target_named
from tests.strategies.cases import evaluate_cases, scene_cases, simplify_cases
from tests.strategies.options import simplify_options, wrong_options

few = settings(max_examples=20, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as place:
        yield Path(place)


@pytest.fixture(autouse=True)
def one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that scenes are built in this process."""
    monkeypatch.setenv("OCCLUDER_THREADS", "1")


@few
@given(simplify_cases())
def test_an_occluder_of_any_mesh_keeps_its_promises(folder, case):
    target_named("simplify").verdict(write_case(case), folder)


@few
@given(evaluate_cases())
def test_any_occluder_is_judged(folder, case):
    target_named("evaluate").verdict(write_case(case), folder)


@settings(few, max_examples=8)
@given(scene_cases())
def test_any_scene_is_built_and_culled(folder, case):
    target_named("scene").verdict(write_case(case), folder)


@settings(max_examples=50)
@given(simplify_options())
def test_options_that_go_together_are_taken(chosen):
    SimplifyOptions.of(chosen)


@settings(max_examples=80)
@given(wrong_options())
def test_wrong_options_raise_nothing_but_refusals(chosen):
    with suppress(OptionError):
        SimplifyOptions.of(chosen)
