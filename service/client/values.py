"""Values: what the server says of jobs, results and assets.

Members that are not known here are left aside, so that a newer server is understood.  Times are as
they came, ISO 8601 in UTC.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from service.jobs.asset import Thresholds
from service.jobs.deliveries import DeliveryState
from service.jobs.job import Failure, JobFacts, JobKind, JobState, Priority, Summary
from service.keep import Keep


@dataclass(frozen=True)
class RemoteProgress:
    """How far a running job is, as :class:`~service.jobs.progress.JobProgress` has it.

    ``picture``  path of a picture of the best so far, on that server; None where there is none.
    """

    stage: str
    fraction: float
    measure: float | None = None
    level: int = 0
    levels: int = 1
    seconds: float = 0.0
    picture: str | None = None


@dataclass(frozen=True, kw_only=True)
class RemoteJob(JobFacts):
    """A job as the server tells it."""

    created: str
    attempt: int = 0
    attempts: int = 0
    started: str | None = None
    ended: str | None = None
    progress: RemoteProgress | None = None


@dataclass(frozen=True)
class RemoteFile:
    """A file of a result; ``sha256`` in hex."""

    name: str
    media_type: str
    size: int
    sha256: str


@dataclass(frozen=True)
class RemoteLevel:
    """A level of detail, finest first; ``files`` gives the name of its file by format."""

    level: int
    triangles: int
    files: Mapping[str, str]
    precision: float | None = None
    recall: float | None = None
    overhang: float | None = None
    verdict: str | None = None
    error_bound: float | None = None
    switch_distance: float | None = None


@dataclass(frozen=True)
class RemoteResult:
    """What a job that succeeded has made; ``report`` as ``docs/report.schema.json`` says.

    ``pages``  names of files that show the report to people, by what they show.
    ``on_demand``  names of files that are made when they are first fetched, pages among them, and
    are among ``files`` from then on.
    """

    job: RemoteJob
    report: Mapping[str, Any] | None
    levels: tuple[RemoteLevel, ...]
    files: tuple[RemoteFile, ...]
    pages: Mapping[str, str] = field(default_factory=dict)
    on_demand: tuple[str, ...] = ()


@dataclass(frozen=True)
class RemoteAsset:
    """A name with its runs; ``holds`` whether the latest keeps the thresholds, if there are any."""

    id: str
    name: str
    created: str
    runs: int
    thresholds: Thresholds
    holds: bool | None
    latest: RemoteJob | None


@dataclass(frozen=True)
class RemoteAttempt:
    """What came of a try to send a webhook; :class:`~service.jobs.deliveries.DeliveryAttempt`."""

    at: str
    milliseconds: float
    status: int | None
    reason: str | None
    excerpt: str | None


@dataclass(frozen=True)
class RemoteDelivery:
    """A webhook: ``id`` is the event's, ``due`` when it is tried next, ``redelivered`` how often it
    was asked for by hand.
    """

    id: str
    state: DeliveryState
    url: str
    created: str
    due: str | None
    redelivered: int
    attempts: tuple[RemoteAttempt, ...]


def delivery_of(data: Mapping[str, Any]) -> RemoteDelivery:
    return RemoteDelivery(
        **{
            **_known_members(RemoteDelivery, data),
            "state": DeliveryState(data["state"]),
            "attempts": tuple(
                RemoteAttempt(**_known_members(RemoteAttempt, one)) for one in data["attempts"]
            ),
        }
    )


def job_of(data: Mapping[str, Any]) -> RemoteJob:
    asset = data.get("asset") or {}
    return RemoteJob(
        **{
            **_known_members(RemoteJob, data),
            "kind": JobKind(data["kind"]),
            "state": JobState(data["state"]),
            "priority": Priority(data.get("priority", Priority.INTERACTIVE)),
            "keep": Keep(data.get("keep", Keep.ALL)),
            "asset": asset.get("name"),
            "asset_id": asset.get("id"),
            "progress": progress_of(data.get("progress")),
            "failure": Failure(**_known_members(Failure, data["failure"]))
            if data.get("failure")
            else None,
            "summary": _summary_of(data.get("summary")),
        }
    )


def progress_of(data: Mapping[str, Any] | None) -> RemoteProgress | None:
    return RemoteProgress(**_known_members(RemoteProgress, data)) if data else None


def result_of(data: Mapping[str, Any]) -> RemoteResult:
    return RemoteResult(
        job=job_of(data["job"]),
        report=data.get("report"),
        levels=tuple(_level_of(level) for level in data["levels"]),
        files=tuple(RemoteFile(**_known_members(RemoteFile, file)) for file in data["files"]),
        pages={
            shown: link.rpartition("/files/")[2] for shown, link in data.get("pages", {}).items()
        },
        on_demand=tuple(one["name"] for one in data.get("on_demand", ())),
    )


def asset_of(data: Mapping[str, Any]) -> RemoteAsset:
    return RemoteAsset(
        **{
            **_known_members(RemoteAsset, data),
            "thresholds": Thresholds(**_known_members(Thresholds, data.get("thresholds") or {})),
            "latest": job_of(data["latest"]) if data.get("latest") else None,
        }
    )


def _level_of(data: Mapping[str, Any]) -> RemoteLevel:
    names = {form: link.rpartition("/files/")[2] for form, link in data["files"].items()}
    return RemoteLevel(**{**_known_members(RemoteLevel, data), "files": names})


def _summary_of(data: Mapping[str, Any] | None) -> Summary | None:
    if not data:
        return None
    known = _known_members(Summary, data)
    return Summary(**{**known, "warnings": tuple(known.get("warnings", ()))})


def _known_members(kind: type[Any], data: Mapping[str, Any]) -> dict[str, Any]:
    return {one.name: data[one.name] for one in fields(kind) if one.name in data}
