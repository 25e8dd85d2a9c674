"""Reading takes time as the bytes do; every case at length is ``python -m tests.fuzz.growth``."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.growth import Growth, growth_of
from tests.fuzz.worst_cases import WORST_CASES, WorstCase

WERE_STEEP = [
    "obj: corners in turn", "obj: groups and materials", "toml: parts of a key", "ply: properties",
    "dae: effects", "dae: lists of vertices", "dae: nodes", "dae: a long namespace",
    "dae: tags without an end", "3mf: tags without an end", "3mf: a long attribute",
    "tif: metadata",
]  # fmt: skip


@pytest.mark.parametrize("name", WERE_STEEP)
def test_what_was_steep_is_not(name: str, tmp_path: Path) -> None:
    found = growth_of(WORST_CASES[name], tmp_path, largest=1 << 17, enough=0.1)
    assert not found.too_steep, found


def test_growth_is_seen(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        data = path.read_bytes()[::16]  # dear on any machine
        sum(one == other for one in data for other in data)

    steep = growth_of(
        WorstCase("pairs", ".bin", read, lambda size: b"x" * size),
        tmp_path, largest=1 << 17, enough=0.1,
    )  # fmt: skip
    assert steep.too_steep


def test_an_exponent_is_that_of_the_times() -> None:
    sizes = (1000, 2000, 4000, 8000)
    assert Growth("", sizes, tuple(1e-12 * s**2 for s in sizes)).exponent == 0.0  # in no time
    assert Growth("", sizes, tuple(1e-7 * s**2 for s in sizes)).exponent == pytest.approx(2.0)
