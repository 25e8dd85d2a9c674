"""Rounds of cleaning: what they free, and that nothing stops them but the end of the server."""

from __future__ import annotations

import io
import logging
import threading
import time
from collections.abc import Collection

import pytest

from service.errors import DatabaseDamagedError
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.cleaning import Cleaned, Cleaner

DAY = 86_400.0


class Rows:
    """The two methods of a job store that cleaning calls, over jobs that have one file each."""

    def __init__(self, ended: dict[str, float]) -> None:
        self.ended = ended
        self.rounds = threading.Semaphore(0)
        self.faults: list[Exception] = []
        self.asked: list[float] = []

    def expire(self, ended_before: float) -> int:
        self.rounds.release()
        self.asked.append(ended_before)
        old = [digest for digest, ended in self.ended.items() if ended < ended_before]
        for digest in old:
            del self.ended[digest]
        return len(old)

    def unnamed(self, digests: Collection[str]) -> set[str]:
        if self.faults:
            raise self.faults.pop()
        return set(digests).difference(self.ended)


@pytest.fixture
def blobs(tmp_path):
    return FileBlobs(tmp_path)


def put(blobs, *contents):
    with blobs.keeping() as keeping:
        return [keeping.put(io.BytesIO(data)).digest for data in contents]


class Entries:
    """A journal of which only the ages are known."""

    def __init__(self, *ages: float) -> None:
        self.ages = list(ages)

    def expire(self, before: float) -> int:
        old = [age for age in self.ages if age < before]
        self.ages = [age for age in self.ages if age >= before]
        return len(old)


class Assets:
    """An asset store of which only the times are known at which assets go."""

    def __init__(self, *goes: float) -> None:
        self.goes = list(goes)

    def remove_due(self, now: float) -> int:
        due = [one for one in self.goes if one <= now]
        self.goes = [one for one in self.goes if one > now]
        return len(due)


def cleaner(rows, blobs, keep_days=10.0, seconds=1000.0, journal_days=30.0, **others):
    others = {"assets": Assets(), "journal": Entries(), "answers": Entries(), **others}
    return Cleaner(
        rows, blobs=blobs, keep_days=keep_days, journal_days=journal_days, seconds=seconds, **others
    )


def wait_for(rows):
    assert rows.rounds.acquire(timeout=10)


def test_a_round_forgets_old_jobs_and_frees_their_blobs(blobs):
    old, young, _orphan = put(blobs, b"old", b"young", b"orphan")
    rows = Rows({old: 0.0, young: 5 * DAY})
    assert cleaner(rows, blobs).clean(now=11 * DAY) == Cleaned(jobs=1, blobs=2)
    assert list(blobs.digests()) == [young]


def test_zero_days_keep_for_ever(blobs):
    (old,) = put(blobs, b"old")
    rows = Rows({old: 0.0})
    assert cleaner(rows, blobs, keep_days=0.0).clean(now=1e12) == Cleaned(0, 0)
    assert rows.asked == []


def test_the_journal_is_kept_for_days_of_its_own(blobs):
    journal, rows = Entries(0.0, 5 * DAY, 20 * DAY), Rows({})
    assert cleaner(rows, blobs, journal=journal).clean(now=40 * DAY) == Cleaned(0, 0, entries=2)
    assert journal.ages == [20 * DAY]
    kept = cleaner(rows, blobs, journal=journal, journal_days=0.0).clean(now=1e12)
    assert (kept.entries, journal.ages) == (0, [20 * DAY])


def test_answers_are_kept_for_a_day(blobs):
    answers = Entries(0.0, 0.5 * DAY, 1.5 * DAY)
    cleaner(Rows({}), blobs, answers=answers, keep_days=0.0).clean(now=1.75 * DAY)
    assert answers.ages == [1.5 * DAY]


def test_rounds_go_on_after_a_failure(blobs, caplog):
    rows = Rows({})
    rows.faults = [DatabaseDamagedError("a page cannot be read"), OSError("disk")]
    put(blobs, b"orphan")
    with caplog.at_level(logging.INFO), cleaner(rows, blobs, seconds=0.001).running():
        for _ in range(4):
            wait_for(rows)
    assert list(blobs.digests()) == []
    assert sum("cleaning failed" in record.message for record in caplog.records) == 2
    assert "0 jobs, 0 assets, 1 blobs and 0 entries" in caplog.text


def test_the_first_round_is_at_once_and_the_end_too(blobs):
    rows = Rows({})
    with cleaner(rows, blobs, seconds=1e6).running():
        wait_for(rows)
    assert not [thread for thread in threading.enumerate() if thread.name == "cleaner"]


def test_a_clock_that_jumps_ahead_makes_no_job_old(blobs, monkeypatch):
    rows, real = Rows({}), time.time
    with cleaner(rows, blobs, seconds=0.001).running():
        wait_for(rows)
        monkeypatch.setattr(time, "time", lambda: real() + 1000 * DAY)
        for _ in range(3):
            wait_for(rows)
    assert max(rows.asked) < real() - 9 * DAY


def test_assets_that_were_removed_go_when_they_are_due(blobs):
    assets = Assets(99.0, 101.0)
    assert cleaner(Rows({}), blobs, assets=assets).clean(100.0).assets == 1
    assert assets.goes == [101.0]
