"""Cells seen from by a pool: the same sets, and nothing believed that arrived damaged."""

from __future__ import annotations

import threading
from functools import cache

import numpy as np
import pytest

from simplifier.geometry.pvs import UNKNOWN
from simplifier.io.pvs_file import encode_pvs
from simplifier.options.visibility import PvsOptions
from simplifier.pools import Answer
from simplifier.visibility import find
from simplifier.visibility.find import Watch, find_pvs
from tests.in_process_pool import InProcessPool
from tests.visibility.test_find import city_and_cells


@pytest.fixture(autouse=True)
def always_worth_it(monkeypatch):
    monkeypatch.setattr(find, "WORTH_A_POOL", 0.0)
    monkeypatch.setattr(find, "_MOST_IN_JOB", 3)


CASES = {
    "cull-map": PvsOptions(up="z", epsilon=2.5, method="cull-map"),
    "slices": PvsOptions(up="z", epsilon=2.5, method="cull-map", slices=True),
    "strong": PvsOptions(up="z", epsilon=2.5, method="strong"),
    "slice-wise": PvsOptions(up="z", epsilon=10.0, method="slice-wise"),
    "auto": PvsOptions(up="z", epsilon=2.5),
}


COUNT = 15
"""Cells, of which a job takes three."""


@cache
def town():
    return city_and_cells(2, COUNT)


def found_by(pool, case="cull-map", **changes):
    return find_pvs(*town(), CASES[case], None, Watch(**changes), pool=pool)


@cache
def bytes_without(case):
    return encode_pvs(found_by(None, case).pvs)


@pytest.mark.parametrize("case", CASES)
def test_the_same_bytes_as_without(case):
    pool, said = InProcessPool(), []
    spread = found_by(pool, case, say=said.append)
    assert pool.done > 3
    assert said == ["the view cells are computed in this process"]
    assert encode_pvs(spread.pvs) == bytes_without(case)
    assert spread.made == COUNT


@pytest.mark.parametrize(
    ("told", "why"),
    [
        (Answer(failure="it died"), "it died"),
        (b"", "arrived damaged"),
        (b"\x01rows", "arrived damaged"),
    ],
)
def test_what_a_worker_could_not_see_counts_as_visible(told, why):
    """And is computed by the next run, from the file."""
    found = found_by(InProcessPool(lambda place, result: told if place == 1 else result))
    lost = np.flatnonzero(found.pvs.row_of == UNKNOWN)
    assert len(lost) == 3
    assert found.pvs.visible(int(lost[0])).all()
    assert any(why in warning and "3 cells" in warning for warning in found.warnings)
    again = find_pvs(*town(), CASES["cull-map"], found.pvs)
    assert again.made == 3
    assert encode_pvs(again.pvs) == bytes_without("cull-map")


def test_cancelled_it_keeps_what_was_seen():
    cancel = threading.Event()

    def hear(done, total):
        if done > 6:
            cancel.set()

    found = found_by(InProcessPool(), tell=hear, cancel=cancel)
    assert found.pvs.partial
    assert 6 < len(found.pvs.computed) < COUNT


def test_little_work_stays_here(monkeypatch):
    monkeypatch.setattr(find, "WORTH_A_POOL", 1e6)
    pool, said = InProcessPool(), []
    found_by(pool, say=said.append)
    assert pool.done == 0
    assert "on this machine" in said[0]
    assert "1e+06 s" in said[0]
