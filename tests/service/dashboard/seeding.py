"""Assets with a past, put into a database at once rather than by jobs."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from sqlalchemy import insert, select

from service.jobs.asset import Thresholds
from service.jobs.job import JobKind, JobState, Summary
from service.storage.database import Database
from service.storage.rows import new_id, summary_columns
from service.storage.tables import AssetRow, JobRow

DAY = 86_400.0


@dataclass(frozen=True)
class Past:
    """An asset: the recalls and precisions of its runs, oldest first, one a day until today."""

    name: str
    recalls: tuple[float, ...] = ()
    precisions: tuple[float, ...] = ()
    thresholds: Thresholds = field(default_factory=Thresholds)
    triangles: int = 64
    input_triangles: int = 5000
    seconds: float = 1.5
    overhang: float | None = 0.0042
    kind: JobKind = JobKind.OCCLUDER


def seed_assets(
    database: Database, pasts: Iterable[Past], now: float, tenant: str = "local"
) -> None:
    """As jobs that succeeded would have left them."""
    listed = list(pasts)
    with database.writing() as session:
        session.execute(insert(AssetRow), [_asset(past, tenant, now) for past in listed])
        numbers = dict(session.execute(
            select(AssetRow.name, AssetRow.number).where(AssetRow.tenant == tenant)
        ).all())  # fmt: skip
        rows = [row for past in listed for row in _runs(past, numbers[past.name], tenant, now)]
        if rows:
            session.execute(insert(JobRow), rows)


def made_up(count: int, *, runs: int) -> Iterator[Past]:
    """Assets as a studio has them; the same each time."""
    chance = random.Random(7)
    rooms = ("props", "buildings", "vehicles", "terrain", "characters/crowd")
    for number in range(count):
        recall, precision = chance.betavariate(8, 2), 1.0 - chance.betavariate(1, 150)
        drift = [chance.gauss(0.0, 0.01) for _ in range(runs)]
        demanded = Thresholds(0.99, 0.7) if number % 3 else Thresholds()
        yield Past(
            f"{chance.choice(rooms)}/asset_{number:05d}",
            tuple(min(1.0, max(0.0, recall + step)) for step in drift),
            tuple(precision for _ in drift),
            demanded,
            chance.choice((12, 24, 32, 64)),
            round(chance.lognormvariate(9.5, 1.4)),
            chance.lognormvariate(0.6, 0.7),
        )


def _asset(past: Past, tenant: str, now: float) -> dict[str, object]:
    return {
        "id": new_id(),
        "tenant": tenant,
        "name": past.name,
        "folded": past.name.casefold(),
        "created": now - DAY * len(past.recalls),
        "min_precision": past.thresholds.min_precision,
        "min_recall": past.thresholds.min_recall,
        "max_overhang": past.thresholds.max_overhang,
    }


def _word(recall: float) -> str:
    return "good" if recall >= 0.4 else "weak" if recall >= 0.1 else "unusable"


def _runs(past: Past, asset: int, tenant: str, now: float) -> Iterator[dict[str, object]]:
    precisions = past.precisions or (0.999,) * len(past.recalls)
    ages = range(len(past.recalls) - 1, -1, -1)
    for age, recall, precision in zip(ages, past.recalls, precisions, strict=True):
        created = now - DAY * age - 60.0
        summary = Summary(
            triangles=past.triangles,
            input_triangles=past.input_triangles,
            levels=3,
            seconds=past.seconds,
            precision=precision,
            recall=recall,
            worst_recall=0.8 * recall,
            worst_view=17,
            overhang=past.overhang,
            verdict=None if past.overhang is None else _word(recall),
            reason=f"it hides {100.0 * recall:.1f} % of what the mesh hides",
            try_next=None if recall >= 0.4 else "occluder simplify mesh.glb -o occluder.glb",
            timings={"voxelize": 0.25, "refine": 1.0},
            warnings=("the mesh is open; its base was closed",),
        )
        yield {
            "id": new_id(), "tenant": tenant, "kind": past.kind,
            "state": JobState.SUCCEEDED, "name": "mesh.glb", "options": {"budget": 64},
            "version": "1.0", "work_key": new_id(), "created": created, "started": created,
            "ended": created + 2.0, "attempt": 1, "attempts": 3, "asset_number": asset,
            "summary": summary_columns(summary), "cancel_asked": False, "beat": 0,
            "lease_seconds": 0.0,
        }  # fmt: skip
