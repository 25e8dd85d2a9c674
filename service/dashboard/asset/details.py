"""What the page of an asset or a job shows, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Protocol, cast

from service.dashboard.view_map import Axis
from service.dashboard.views import View, views_of
from service.jobs.asset import Asset, AssetStore, Thresholds
from service.jobs.job import OVERRIDES_FILE, Job, JobKind
from service.jobs.on_demand import LOSS, ORIGINAL
from service.jobs.stores import BlobStore, JobStore
from service.routes.results import read_report
from service.schemas.job import JobBody
from service.schemas.options import OptionTable
from service.schemas.result import LaterFile, Level, Result, ResultFile, zip_link

_HISTORY = 200
_SHEET = "pictures/silhouettes.png"


class Stores(Protocol):
    """The part of the service's stores that is read here."""

    @property
    def jobs(self) -> JobStore: ...
    @property
    def assets(self) -> AssetStore: ...
    @property
    def blobs(self) -> BlobStore: ...
    @property
    def tables(self) -> Mapping[JobKind, OptionTable]: ...


@dataclass(frozen=True)
class Solid:
    """What the occluder had to stay within.

    ``cells``  voxels along x, y and z; ``cell_size`` in the mesh's units.
    ``inside``  share of the grid that is inside, 0 to 1.
    ``closed_by``  what closed openings, and the volume that it added.
    ``dropped``  triangles of the input that were of no use, by reason.
    """

    cells: tuple[int, ...]
    cell_size: float
    inside: float
    closed_by: tuple[tuple[str, float], ...]
    dropped: Mapping[str, int]

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> Solid:
        solid = report["solid"]
        return cls(
            cells=tuple(solid["resolution"]),
            cell_size=solid["cell_size"],
            inside=solid["inside_fraction"],
            closed_by=tuple((one["by"], one["volume"]) for one in solid["closed_by"]),
            dropped={why: count for why, count in report["input"]["dropped"].items() if count},
        )


@dataclass(frozen=True)
class RunDetail:
    """A job with all that came of it; empty where it has not succeeded, or its kind has none.

    ``original``  address of the mesh to look at; ``loss`` of where on it recall is lost;
    ``sheet`` of the picture of its silhouettes; ``overrides`` of the overrides that came with it.
    ``later``     what is made when somebody first asks for it.
    ``pages``     addresses of what shows the report, by what it shows.
    ``left_out``  why levels that were asked for are not there, a sentence each.
    ``deviation``  the largest distance that the occluder was found to have, mesh's units.
    """

    job: Job
    levels: tuple[Level, ...] = ()
    views: tuple[View, ...] = ()
    files: tuple[ResultFile, ...] = ()
    later: tuple[LaterFile, ...] = ()
    pages: Mapping[str, str] = field(default_factory=dict)
    solid: Solid | None = None
    deviation: float | None = None
    left_out: tuple[str, ...] = ()

    @property
    def up(self) -> Axis:
        return cast(Axis, self.job.options.get("up", "y"))

    @property
    def original(self) -> str | None:
        return self._link(ORIGINAL)

    @property
    def zip(self) -> str:
        """Address of all results at once."""
        return zip_link(self.job.id)

    @property
    def loss(self) -> str | None:
        return self._link(LOSS)

    @property
    def sheet(self) -> str | None:
        return self.pages.get("silhouettes") or self._link(_SHEET)

    @property
    def overrides(self) -> str | None:
        return self._link(OVERRIDES_FILE)

    def _link(self, name: str) -> str | None:
        there: tuple[ResultFile | LaterFile, ...] = (*self.files, *self.later)
        return next((file.link for file in there if file.name == name), None)


@dataclass(frozen=True)
class RunLine:
    """A run in the history.

    ``kind``     tells an evaluation of an occluder made elsewhere from a run of our own.
    ``options``  those that are not as by default, in words.
    """

    job_id: str
    kind: JobKind
    created: datetime
    version: str
    precision: float | None
    recall: float | None
    worst_recall: float | None
    overhang: float | None
    verdict: str | None
    triangles: int
    seconds: float
    holds: bool | None
    options: str


@dataclass(frozen=True)
class AssetDetail:
    """An asset, its latest runs, newest first, and one of them in full; None where none is.

    ``folders``  the thresholds of all folders, by path.
    """

    asset: Asset
    history: tuple[RunLine, ...]
    run: RunDetail | None
    folders: Mapping[str, Thresholds]


def read_asset(
    stores: Stores, tenant: str, asset_id: str, job_id: str | None = None
) -> AssetDetail:
    """An asset with its latest run, or with another.  Waits for database and disk.

    Raises :class:`~service.errors.NotFoundError`.
    """
    asset = stores.assets.asset(tenant, asset_id)
    runs = stores.assets.runs(tenant, asset_id, limit=_HISTORY).runs
    history = tuple(run_line(stores, asset, job) for job in runs)
    if job_id is None:
        job_id = asset.latest.id if asset.latest else None
    run = read_run(stores, tenant, job_id) if job_id else None
    return AssetDetail(asset, history, run, stores.assets.folder_thresholds(tenant))


def read_run(stores: Stores, tenant: str, job_id: str) -> RunDetail:
    """Waits for database and disk.  Raises :class:`~service.errors.NotFoundError`."""
    job = stores.jobs.job(tenant, job_id)
    files = stores.jobs.files(job.id)
    report = read_report(stores.blobs, files)
    result = Result.of(JobBody.of(job, whole_webhook=False), report, files)
    judged = None if job.kind is JobKind.VISIBILITY else report
    return RunDetail(
        job=job,
        levels=tuple(result.levels),
        views=views_of(judged) if judged else (),
        files=tuple(result.files),
        later=tuple(result.on_demand),
        pages=result.pages,
        solid=Solid.of(judged) if judged else None,
        deviation=judged["deviation"] if judged else None,
        left_out=tuple(_left_out(judged["left_out"])) if judged else (),
    )


def run_line(stores: Stores, asset: Asset, job: Job) -> RunLine:
    """The line of a run, which has succeeded, in the history of its asset."""
    summary = job.summary
    assert summary is not None, "runs are jobs that have succeeded"
    return RunLine(
        job_id=job.id,
        kind=job.kind,
        created=datetime.fromtimestamp(job.created, UTC),
        version=job.version,
        precision=summary.precision,
        recall=summary.recall,
        worst_recall=summary.worst_recall,
        overhang=summary.overhang,
        verdict=summary.verdict,
        triangles=summary.triangles,
        seconds=summary.seconds,
        holds=asset.demanded.held_by(summary),
        options=chosen_options(stores.tables[job.kind], job.options),
    )


def chosen_options(table: OptionTable, options: Mapping[str, Any]) -> str:
    """The options that are not as by default, in words."""
    default = table.read({})
    chosen = [
        f"{name.replace('_', ' ')} {_value_words(value)}"
        for name, value in options.items()
        if name in default and value != default[name]
    ]
    return ", ".join(chosen) or "defaults"


def _value_words(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return f"{value:g}"
    return str(value)


def _left_out(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return [f"at {row['resolution']} voxels: {row['reason']}" for row in rows]
