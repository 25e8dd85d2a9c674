"""What the page of a trade-off shows, as plain values.  All functions wait for the database."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.answers.files import read_file
from service.dashboard.visitor import Visitor
from service.errors import NotFoundError
from service.jobs.asset import Asset
from service.jobs.job import Job, JobKind, JobState, Summary
from service.jobs.stores import JobFilter

MOST_RUNS = 500
_ASIDE = ("load", "write", "accuracy")
"""Stages that are no part of making an occluder."""
_NAMED = ("budget", "preset", "resolution", "error_bound", "time_limit", "moves", "ground")


@dataclass(frozen=True)
class Point:
    """A run, or a setting of a sweep.

    ``name``     its settings in words; ``seconds`` from the mesh in memory to the triangles.
    ``front``    whether nothing is as fast and recalls as much, of those precise enough.
    ``job_id``   whose it is.
    ``standing`` of a setting, as the library says; empty for a run.
    """

    name: str
    budget: int
    seconds: float
    recall: float
    precision: float
    triangles: int
    job_id: str
    front: bool = False
    standing: str = ""
    overhang: float | None = None


@dataclass(frozen=True)
class Tradeoff:
    """All that is known of an asset.

    ``runs``    newest first; ``swept`` as its latest sweep measured, in the order it ran.
    ``failed``  settings of the sweep that gave no result, each with its reason.
    ``precision``  the least that a point of a front has.
    ``going``   the sweep that has not ended, if any; ``sweep`` the latest that has succeeded.
    """

    asset: str
    asset_id: str
    budget: int | None
    runs: tuple[Point, ...]
    swept: tuple[Point, ...]
    failed: tuple[tuple[str, str], ...]
    advice: tuple[str, ...]
    machine: str
    precision: float
    going: str | None
    sweep: str | None


def tradeoff_of(visitor: Visitor, asset_id: str) -> Tradeoff:
    """Raises :class:`~service.errors.NotFoundError`."""
    services, tenant = visitor.services, visitor.caller().tenant
    asset = services.assets.asset(tenant, asset_id)
    runs = services.assets.runs(tenant, asset_id, limit=MOST_RUNS).runs
    going = _latest(visitor, asset, [JobState.QUEUED, JobState.RUNNING])
    sweep = _latest(visitor, asset, [JobState.SUCCEEDED])
    document = _document(visitor, sweep) if sweep else {}
    precision = float(document.get("precision", 0.99))
    settings: Sequence[Mapping[str, Any]] = document.get("settings", ())
    return Tradeoff(
        asset=asset.name,
        asset_id=asset.id,
        budget=_budget(asset.latest),
        runs=with_front(points_of(runs), precision),
        swept=tuple(_setting(row, sweep.id) for row in settings if "recall" in row)
        if sweep
        else (),
        failed=tuple((_name(row), row["reason"]) for row in settings if "reason" in row),
        advice=tuple(document.get("advice", ())),
        machine=document.get("machine", ""),
        precision=precision,
        going=going.id if going else None,
        sweep=sweep.id if sweep else None,
    )


def points_of(runs: Iterable[Job]) -> list[Point]:
    """The points of those runs that have been judged."""
    return [
        Point(
            name=run_name(run.options),
            budget=int(run.options.get("budget", 0)),
            seconds=making_seconds(run.summary),
            recall=run.summary.recall,
            precision=run.summary.precision,
            triangles=run.summary.triangles,
            job_id=run.id,
            overhang=run.summary.overhang,
        )
        for run in runs
        if run.kind is JobKind.OCCLUDER
        and run.summary is not None
        and run.summary.recall is not None
        and run.summary.precision is not None
    ]


def with_front(points: Sequence[Point], precision: float) -> tuple[Point, ...]:
    """The points in their order, those on the front marked."""
    best, front = -1.0, set[int]()
    ranked = sorted(range(len(points)), key=lambda at: (points[at].seconds, -points[at].recall))
    for at in ranked:
        if points[at].precision >= precision and points[at].recall > best:
            best = points[at].recall
            front.add(at)
    return tuple(Point(**{**vars(point), "front": at in front}) for at, point in enumerate(points))


def making_seconds(summary: Summary) -> float:
    """Seconds from the mesh in memory to the triangles; of all where stages are not known."""
    stages = [value for name, value in summary.timings.items() if name not in _ASIDE]
    return sum(stages) if stages else summary.seconds


def run_name(options: Mapping[str, Any]) -> str:
    """The settings that make most of the difference, in words."""
    said = []
    for name in _NAMED:
        value = options.get(name)
        if value is None or value is False:
            continue
        words = name.replace("_", " ")
        said.append(words if value is True else f"{words} {value}")
    return ", ".join(said)


def _latest(visitor: Visitor, asset: Asset, states: Iterable[JobState]) -> Job | None:
    wanted = JobFilter(frozenset(states), frozenset([JobKind.TRADEOFF]), asset.id)
    page = visitor.services.jobs.jobs(asset.tenant, wanted, before=None, limit=1)
    return page.jobs[0] if page.jobs else None


def _document(visitor: Visitor, sweep: Job) -> Mapping[str, Any]:
    """Empty where it is stored no more."""
    services = visitor.services
    for file in services.jobs.files(sweep.id):
        if file.name == "tradeoff.json":
            try:
                document: Mapping[str, Any] = json.loads(read_file(services.blobs, file))
            except NotFoundError:
                return {}
            return document
    return {}


def _setting(row: Mapping[str, Any], job_id: str) -> Point:
    return Point(
        name=row["setting"], budget=row["budget"], seconds=row["seconds"], recall=row["recall"],
        precision=row["precision"], triangles=row["triangles"], job_id=job_id,
        front=row["standing"] == "front", standing=row["standing"],
        overhang=row.get("overhang"),  # sweeps of before it was measured have none
    )  # fmt: skip


def _name(row: Mapping[str, Any]) -> str:
    budget = f", budget {row['budget']:,}" if "budget" in row else ""
    return f"{row.get('setting', row['mesh'])}{budget}"


def _budget(latest: Job | None) -> int | None:
    budget = latest.options.get("budget") if latest else None
    return budget if isinstance(budget, int) else None
