"""The CSV is strict and stable."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from simplifier.tradeoff.study import study_files
from simplifier.tradeoff.sweep import Setting, Trial
from simplifier.tradeoff.table import COLUMNS
from tests.tradeoff.sweeps import HOSTILE, plain_trials, study, trial

PAGE = Path(__file__).parents[2] / "docs" / "tradeoff.md"


def table(made):
    name, data = next(study_files(made))
    assert name == "tradeoff.csv"
    return data


def rows(data):
    header, *found = csv.reader(data.decode("utf-8").splitlines(keepends=True), strict=True)
    assert tuple(header) == COLUMNS
    assert all(len(row) == len(header) for row in found)
    return [dict(zip(header, row, strict=True)) for row in found]


def test_a_row_a_setting():
    made = study([*plain_trials(), *plain_trials()])
    found = rows(table(made))
    assert len(found) == 8
    row = next(row for row in found if row["setting"] == "best")
    assert {key: row[key] for key in COLUMNS[:23]} == {
        "mesh": "a.obj", "budget": "16", "setting": "best", "preset": "best", "resolution": "64",
        "directions": "128", "depths": "4", "exchanges": "8", "time": "", "moves": row["moves"],
        "ground": "no", "up": "y", "seed": "0", "seconds": "8.000000", "seconds_min": "8.000000",
        "seconds_max": "8.000000", "repeats": "2", "triangles": "16", "precision": "0.999000",
        "recall": "0.530000", "standing": "dominated", "dominated_by": "time 2 s", "reason": "",
    }  # fmt: skip
    timed = next(row for row in found if row["setting"] == "time 2 s")
    assert (timed["time"], timed["moves"], timed["standing"]) == ("2", "", "front")
    settings = {row["setting"] for row in found}
    assert {row["dominated_by"] for row in found} - {""} <= settings


def test_failures_have_rows():
    gone = Trial("gone.obj", None, failure="no such file")
    broken = Trial("a.obj", Setting(16, time=4.0), failure="out of memory")
    found = rows(table(study([*plain_trials(), broken, gone])))
    assert [row["standing"] for row in found[-2:]] == ["failed", "failed"]
    assert (found[-2]["setting"], found[-2]["reason"]) == ("time 4 s", "out of memory")
    assert (found[-1]["mesh"], found[-1]["setting"]) == ("gone.obj", "")
    assert found[-1]["reason"] == "no such file"
    assert found[-2]["seconds"] == found[-1]["recall"] == ""


def test_any_name_is_one_cell():
    strange = trial(Setting(16), 1.0, 0.5, mesh="half \udcff", warnings=("a, b", 'c "d"'))
    found = rows(table(study([*plain_trials(HOSTILE), strange])))
    assert found[0]["mesh"] == HOSTILE
    assert found[-1]["mesh"] == "half \\udcff"
    assert found[-1]["warnings"] == 'a, b; c "d"'


def test_the_same_trials_give_the_same_bytes():
    assert table(study()) == table(study())
    assert b"\r" not in table(study())


def test_the_page_names_every_column():
    named = re.findall(r"^\| `(\w+)`", PAGE.read_text("utf-8"), flags=re.MULTILINE)
    assert tuple(named) == COLUMNS
