"""Inputs that are kept: to begin from, from earlier runs, and those that once failed.

tests/fuzz/corpus/TARGET/     in the repository: small valid files, and odd ones
tests/fuzz/fixtures/TARGET/   in the repository: what found a bug, by the bug's name
out/fuzz/corpus/TARGET/       grown by every run, by hash
out/fuzz/failures/TARGET/     what fails now, with its traceback in a .txt beside it
"""

from __future__ import annotations

import hashlib
from pathlib import Path

_HERE = Path(__file__).parent

CORPUS = _HERE / "corpus"
FIXTURES = _HERE / "fixtures"

GROWN = Path("out", "fuzz", "corpus")
FAILURES = Path("out", "fuzz", "failures")


def kept_inputs(target: str) -> list[Path]:
    """Of the repository, by name."""
    return [path for place in (CORPUS, FIXTURES) for path in _files(place / target)]


def all_inputs(target: str) -> list[Path]:
    """And those of earlier runs."""
    return kept_inputs(target) + _files(GROWN / target)


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("*") if path.is_file())


def digest(data: bytes | str) -> str:
    """A short name for some content."""
    return hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest()[:16]


def keep(target: str, data: bytes) -> None:
    """For runs to come."""
    place = GROWN / target
    place.mkdir(parents=True, exist_ok=True)
    (place / digest(data)).write_bytes(data)
