"""Failing inputs: one a bug, made small, and said how to see it again."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.corpus import FAILURES, digest
from tests.fuzz.minimise import minimised_bytes, minimised_case
from tests.fuzz.targets import DRAWN
from tests.fuzz.watched import Outcome, Watched

_MINIMISING_SECONDS = 60.0
_OF_CASES = {target.name for target in DRAWN}


@dataclass(frozen=True)
class Finding:
    """``fault`` as of :class:`~tests.fuzz.watched.Outcome`; ``path`` of the smallest input."""

    target: str
    fault: str
    path: Path


def record(target: str, data: bytes, outcome: Outcome, watched: Watched) -> Finding:
    """Write the input, make it smaller for at most a minute, and write that in its place."""
    path = FAILURES / target / digest(outcome.fault)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, target, data, outcome)
    end = time.monotonic() + _MINIMISING_SECONDS

    def fails(tried: bytes) -> bool:
        return time.monotonic() < end and watched.tried(target, tried).fault == outcome.fault

    minimise = minimised_case if target in _OF_CASES else minimised_bytes
    if fails(data):  # else it depends on what was tried before
        data = minimise(data, fails)
    _write(path, target, data, outcome)
    return Finding(target, outcome.fault, path)


def _write(path: Path, target: str, data: bytes, outcome: Outcome) -> None:
    path.write_bytes(data)
    told = f"{outcome.fault}\n\npython -m tests.fuzz.replay {path}\n\n{outcome.trace}"
    path.with_suffix(".txt").write_bytes(told.encode("utf-8", "backslashreplace"))
