"""Cases that hang, die, take all memory or break a promise are told, and others go on."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.fuzz.corpus import kept_inputs
from tests.fuzz.misbehaving import misbehaving
from tests.fuzz.watched import Watched


@pytest.fixture(scope="module")
def broken() -> Iterator[Watched]:
    with Watched(find=misbehaving) as process:
        yield process


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"hang", "takes more than 1 s"),
        (b"die", "the process dies of SIGABRT"),
        (b"leave", "the process ends with 3"),
        (b"eat", "MemoryError in tests/fuzz/misbehaving.py: _misbehave"),
        (b"break", "AssertionError in tests/fuzz/misbehaving.py: _misbehave (# voxels out)"),
    ],
)
def test_a_fault_is_named_and_the_next_case_is_tried(
    broken: Watched, data: bytes, fault: str
) -> None:
    assert broken.tried("any", data).fault == fault
    assert broken.tried("any", b"good").verdict == "taken"


def test_a_refusal_is_no_fault_unless_it_cannot_be_read(broken: Watched) -> None:
    assert broken.tried("any", b"refuse").verdict == "UnreadableMeshError"
    assert "one printable line" in broken.tried("any", b"mumble").fault


def test_lines_of_the_readers_are_told_once() -> None:
    (path,) = (path for path in kept_inputs("off") if path.name == "colours")
    with Watched(records=True) as watched:
        first = watched.tried("off", path.read_bytes()).lines
        assert any(name.endswith("io/off.py") for name, _ in first)
        assert not watched.tried("off", path.read_bytes()).lines
        more = watched.tried("off", b"4OFF\n").lines
        assert more
        assert not more & first
