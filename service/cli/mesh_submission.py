"""The way of one mesh: sent, waited for, its occluders fetched."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.client import Client, ClientError, RemoteJob, StoppedError
from service.jobs.job import JobState

ReportStep = Callable[[str, float, float | None], None]
"""Told what is done now, the share of it, and the measure so far."""


@dataclass(frozen=True)
class MeshSubmission:
    """A mesh, what to make of it, and where to.

    ``target``     the file of a single occluder.
    ``overrides``  the file of what was decided about the mesh, if there is one.
    """

    mesh: Path
    target: Path
    options: Mapping[str, Any]
    asset: str | None
    overrides: Path | None = None


@dataclass(frozen=True)
class MeshOutcome:
    """What came of a mesh: its job and the files written, or why not."""

    submission: MeshSubmission
    job: RemoteJob | None = None
    files: tuple[Path, ...] = ()
    fault: str = ""


def submit_one(
    client: Client, submission: MeshSubmission, tell: ReportStep, begun: Callable[[str], None]
) -> MeshOutcome:
    """Never raises what one mesh may bring about; ``begun`` hears the job's id."""
    try:
        return _make_remotely(client, submission, tell, begun)
    except StoppedError:
        return MeshOutcome(submission, fault="cancelled")
    except ClientError as error:
        return MeshOutcome(submission, fault=str(error))
    except OSError as error:
        return MeshOutcome(submission, fault=f"{error.strerror or error} ({error.filename})")


def _make_remotely(
    client: Client, submission: MeshSubmission, tell: ReportStep, begun: Callable[[str], None]
) -> MeshOutcome:
    job = client.submit(
        submission.mesh,
        options=submission.options,
        asset=submission.asset,
        overrides=submission.overrides,
        tell=lambda share: tell("uploading", share, None),
    )
    begun(job.id)
    if not job.state.ended:
        job = client.wait(job.id, lambda now: _report_job(now, tell))
    if job.state is not JobState.SUCCEEDED:
        return MeshOutcome(submission, job, fault=_reason(job))
    tell("downloading", 0.0, None)
    return MeshOutcome(submission, job, _fetch(client, job, submission.target))


def _report_job(job: RemoteJob, tell: ReportStep) -> None:
    if job.progress is None:
        tell(job.state, 0.0, None)
    else:
        tell(job.progress.stage, job.progress.fraction, job.progress.measure)


def _reason(job: RemoteJob) -> str:
    if job.failure is None:
        return str(job.state)
    return "; ".join(filter(None, [job.failure.detail, job.failure.remedy]))


def _fetch(client: Client, job: RemoteJob, target: Path) -> tuple[Path, ...]:
    """Fetch all levels in one GLB; in other formats a file a level, named as the library does."""
    form = target.suffix[1:]
    levels = [level.level for level in client.result(job.id).levels]
    if form == "glb" or len(levels) == 1:
        return (client.download(job.id, target, form=form),)
    return tuple(
        client.download(
            job.id, target.with_name(f"{target.stem}_lod{level}{target.suffix}"),
            level=level, form=form,
        )
        for level in levels
    )  # fmt: skip
