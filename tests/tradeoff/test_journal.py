"""Sweeps that go on where they were killed."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import pytest

from simplifier.accuracy.accuracy import AccuracyOptions
from simplifier.errors import CancelledError, OutputError
from simplifier.tradeoff import sweep as sweeping
from simplifier.tradeoff.journal import Journal
from simplifier.tradeoff.study import sweep_tradeoff
from simplifier.tradeoff.sweep import settings_of
from tests.solids import box
from tests.tradeoff.sweeps import SMALL

MESH = box((1.0, 2.0, 3.0))
OPTIONS = replace(SMALL, resolutions=(8,), directions=(4,), budgets=(8,), times=(0.01,))


class Stop:
    """A cancel that comes after some runs."""

    def __init__(self, runs):
        self.left = runs

    def is_set(self):
        return self.left <= 0


@pytest.fixture
def runs(monkeypatch):
    """Each run is counted, and short: coarse, of few moves, by no clock, judged by few views."""
    ran = []
    whole = sweeping.simplify_mesh

    def counted(mesh, options, **more):
        ran.append(options)
        short = replace(
            options, solid=replace(options.solid, resolution=8), time_limit=None,
            refine=replace(options.refine, moves=20, searches=1, overhang=1.0, decimated=False),
        )  # fmt: skip
        return whole(mesh, short, **{**more, "cancel": None})

    monkeypatch.setattr(sweeping, "simplify_mesh", counted)
    monkeypatch.setattr(sweeping, "AccuracyOptions", partial(AccuracyOptions, 16, 64))
    return ran


def cut_short(path, after):
    """A sweep that is given up after so many runs."""
    stop = Stop(after)

    def tell(done, of, now):
        if done >= after:
            raise CancelledError("as if killed")

    with pytest.raises(CancelledError):
        sweep_tradeoff(MESH, OPTIONS, tell=tell, cancel=stop, journal=path)


def test_it_goes_on_where_it_was_and_ends_alike(tmp_path, runs):
    path, count = tmp_path / "journal", len(settings_of(OPTIONS))
    cut_short(path, 3)
    kept = [json.loads(line) for line in path.read_text().splitlines()[1:]]
    assert len(kept) == len(runs) == 3
    with path.open("a") as file:
        file.write('{"mesh": "half a li')  # a kill in the middle of a line
    found = sweep_tradeoff(MESH, OPTIONS, journal=path)
    assert len(runs) == count
    assert [row["seconds"] for row in found.rows][:3] == [line["seconds"] for line in kept]
    assert [row["recall"] for row in found.rows] == [
        row["recall"] for row in sweep_tradeoff(MESH, OPTIONS).rows
    ]
    assert not path.exists()


def test_another_mesh_and_other_options_are_measured_anew(tmp_path, runs):
    path = tmp_path / "journal"
    cut_short(path, 2)
    sweep_tradeoff(box((1.0, 1.0, 1.0)), OPTIONS, journal=path)
    assert len(runs) == 2 + len(settings_of(OPTIONS))
    runs.clear()
    cut_short(path, 2)
    assert len(Journal.open(path, OPTIONS)) == 2
    assert len(Journal.open(path, replace(OPTIONS, seed=5))) == 0


def test_where_nothing_can_be_written_is_told(tmp_path):
    with pytest.raises(OutputError, match="there is no folder"):
        Journal.open(tmp_path / "none" / "journal", OPTIONS)
