"""A sweep as one call: its rows, its files, its progress and its end."""

from __future__ import annotations

import json
import threading

import pytest

from simplifier import CancelledError, TradeoffOptions, sweep_tradeoff
from simplifier.geometry.overrides import DrawnPart, Overrides
from tests.solids import box

TINY = TradeoffOptions.of(
    {"resolutions": [8], "directions": [4], "budgets": [12], "times": [0.05], "repeats": 1}
)


def test_a_sweep_gives_a_row_a_setting_and_tells_how_far_it_is():
    told = []
    study = sweep_tradeoff(box(), TINY, name="b\nox", tell=lambda *now: told.append(now))
    names = ["draft", "balanced", "best", "resolution 8", "4 directions", "time 0.05 s"]
    assert [row["setting"] for row in study.rows] == names
    assert {row["mesh"] for row in study.rows} == {"b\nox"}
    assert any(row["standing"] == "front" for row in study.rows)
    assert [(done, runs) for done, runs, _ in told] == [(n, 6) for n in range(7)]
    files = dict(study.files())
    assert list(files) == ["tradeoff.csv", "tradeoff.json", "tradeoff.png", "tradeoff.html"]
    document = json.loads(files["tradeoff.json"])
    assert document["settings"] == study.rows
    assert document["advice"] == study.lines


def test_a_sweep_ends_soon_when_it_is_cancelled():
    cancel = threading.Event()

    def tell(done, runs, now):
        if done == 2:
            cancel.set()

    with pytest.raises(CancelledError, match="after 2 of 6 runs"):
        sweep_tradeoff(box(), TINY, tell=tell, cancel=cancel)


def test_overrides_hold_for_every_run():
    solid = box()
    small = 0.5 + 0.1 * (solid.vertices[solid.faces] - 0.5)
    study = sweep_tradeoff(box(), TINY, overrides=Overrides((DrawnPart("core", small),)))
    assert {row["triangles"] for row in study.rows} == {12}  # nothing is left of the budget
    assert max(row["recall"] for row in study.rows) < 0.1  # a core of a tenth of the box
