"""What the page of all assets shows, as plain values.

They are read once for all pages that show the same.
"""

from __future__ import annotations

import threading
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from weakref import WeakKeyDictionary

from service.jobs.asset import (
    AssetStore,
    FailedUpload,
    RemovedAsset,
    RunNumbers,
    Standing,
    Thresholds,
)

_NOTICED = 0.0005
"""Change of a share from which on a run counts as worse: half of the last digit that is shown."""

_MOST_KEPT = 4
"""Readings of a store; each of 5,000 assets takes 10 MiB."""
_kept: WeakKeyDictionary[AssetStore, dict[tuple[str, datetime], Overview]] = WeakKeyDictionary()
_lock = threading.Lock()


class Holds(StrEnum):
    """Whether an asset's latest run keeps its thresholds, in a word."""

    MET = "met"
    MISSED = "missed"
    OPEN = "none set"
    NEVER_RUN = "no run yet"


@dataclass(frozen=True, slots=True)
class AssetLine:
    """What the page shows of one asset.

    ``thresholds``  its own; ``demanded`` those that count.
    ``failed``      the job of its newest upload, where that failed.
    """

    id: str
    name: str
    thresholds: Thresholds
    demanded: Thresholds
    holds: Holds
    latest: RunNumbers | None
    recalls: tuple[float, ...]
    failed: str | None = None

    @classmethod
    def of(cls, standing: Standing, failed: str | None = None) -> AssetLine:
        return cls(
            id=standing.id,
            name=standing.name,
            thresholds=standing.thresholds,
            demanded=standing.demanded,
            holds=_holds(standing.demanded, standing.latest),
            latest=standing.latest,
            recalls=standing.recalls,
            failed=failed,
        )


@dataclass(frozen=True, slots=True)
class Change:
    """An asset whose latest run is worse than the one it had on some day.

    ``precision``, ``recall``  before and after, of those that fell; ``overhang`` if it rose.
    """

    line: AssetLine
    before: RunNumbers
    precision: tuple[float, float] | None
    recall: tuple[float, float] | None
    overhang: tuple[float, float] | None = None

    @property
    def fall(self) -> float:
        """The largest one, or rise."""
        pairs = [pair for pair in (self.precision, self.recall, self.overhang) if pair is not None]
        return max(abs(before - after) for before, after in pairs)


@dataclass(frozen=True, eq=False)
class Overview:
    """All assets by name, and those that got worse since a day, the largest fall first.

    ``failed``   uploads that failed and were not made good, newest first.
    ``folders``  what is demanded of folders, by path.
    ``removed``  what can be restored.
    ``stamp``    of the store, from before it was read.
    """

    lines: tuple[AssetLine, ...]
    worse: tuple[Change, ...]
    since: datetime
    stamp: Hashable
    failed: tuple[FailedUpload, ...] = ()
    folders: Mapping[str, Thresholds] = field(default_factory=dict)
    removed: tuple[RemovedAsset, ...] = ()


def summary(overview: Overview) -> str:
    """The whole overview in a line of words."""
    count = len(overview.lines)
    missed = _count(sum(line.holds is Holds.MISSED for line in overview.lines))
    worse = _count(len(overview.worse))
    day = f"{overview.since.day} {overview.since:%B %Y}"
    failed = _count(len(overview.failed))
    return (
        f"{count:,} {'asset' if count == 1 else 'assets'}. Failed uploads: {failed}. "
        f"Below a threshold: {missed}. Got worse since {day}: {worse}."
    )


def _count(number: int) -> str:
    return f"{number:,}" if number else "none"


def read_overview(assets: AssetStore, tenant: str, since: datetime) -> Overview:
    """Waits for the database: half a second for 5,000 assets with 20 runs each."""
    stamp = assets.stamp(tenant)  # first, so that what comes meanwhile is seen the next time
    failed = assets.failed(tenant, since.timestamp())
    jobs = {one.asset_id: one.job_id for one in failed}
    lines = tuple(AssetLine.of(one, jobs.get(one.id)) for one in assets.standings(tenant))
    before = assets.runs_at(tenant, since.timestamp())
    return Overview(
        lines, falls_since(lines, before), since, stamp, failed,
        assets.folder_thresholds(tenant), assets.removed(tenant),
    )  # fmt: skip


def falls_since(
    lines: tuple[AssetLine, ...], before: Mapping[str, RunNumbers]
) -> tuple[Change, ...]:
    """Assets whose latest run is worse than the one before, which is given by asset id."""
    changes = (_change(line, before[line.id]) for line in lines if line.id in before)
    found = [change for change in changes if change is not None]
    return tuple(sorted(found, key=lambda change: -change.fall))


def _change(line: AssetLine, before: RunNumbers) -> Change | None:
    after = line.latest
    if after is None or after.job_id == before.job_id:
        return None
    precision = _fall(before.precision, after.precision)
    recall = _fall(before.recall, after.recall)
    rise = _fall(after.overhang, before.overhang)
    overhang = None if rise is None else (rise[1], rise[0])
    if precision is None and recall is None and overhang is None:
        return None
    return Change(line, before, precision, recall, overhang)


def _fall(before: float | None, after: float | None) -> tuple[float, float] | None:
    if before is None or after is None or before - after < _NOTICED:
        return None
    return before, after


def _holds(thresholds: Thresholds, latest: RunNumbers | None) -> Holds:
    if latest is None:
        return Holds.NEVER_RUN
    held = thresholds.held_by(latest)
    if held is None:
        return Holds.OPEN
    return Holds.MET if held else Holds.MISSED


def midnight(day: str) -> datetime:
    """The beginning of a day, UTC, from its ISO form.  Raises ValueError."""
    return datetime.strptime(day, "%Y-%m-%d").replace(tzinfo=UTC)


def shared_overview(assets: AssetStore, tenant: str, since: datetime) -> Overview:
    """The very same value until something has changed.  Waits for the database."""
    with _lock:  # pages that look at the same time wait for one of them to read
        kept = _kept.setdefault(assets, {})
        overview = kept.pop((tenant, since), None)
        if overview is None or overview.stamp != assets.stamp(tenant):
            overview = read_overview(assets, tenant, since)
        kept[tenant, since] = overview
        if len(kept) > _MOST_KEPT:
            del kept[next(iter(kept))]
        return overview
