"""The corpus, and every input that once found a bug: under the name of the bug."""

from __future__ import annotations

from pathlib import Path

import pytest

from simplifier.io.formats import readable_suffixes
from tests.fuzz.corpus import CORPUS, FIXTURES, kept_inputs
from tests.fuzz.targets import TARGETS
from tests.fuzz.watched import Watched

INPUTS = [path for target in TARGETS for path in kept_inputs(target)]
_MOST_BYTES = 400_000


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_kept_input_is_taken_or_refused(watched: Watched, path: Path) -> None:
    outcome = watched.tried(path.parent.name, path.read_bytes())
    assert outcome.verdict, f"{outcome.fault}\n{outcome.trace}"


def test_every_target_has_a_corpus_and_every_folder_is_a_target() -> None:
    assert {path.name for path in CORPUS.iterdir()} == set(TARGETS)
    assert {path.name for path in FIXTURES.iterdir()} <= set(TARGETS)


def test_every_format_that_is_read_is_a_target() -> None:
    assert {suffix.removeprefix(".") for suffix in readable_suffixes()} <= set(TARGETS)


def test_the_corpus_stays_small() -> None:
    assert sum(path.stat().st_size for path in INPUTS) < _MOST_BYTES
