"""Values: a job, what it is asked, what came of it.  Times are Unix seconds, UTC."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import PurePosixPath
from typing import Any

from service.keep import Keep


class JobKind(StrEnum):
    """What is to be made."""

    OCCLUDER = "occluder"
    """Occluders by level from a mesh, and their report."""
    EVALUATION = "evaluation"
    """The report of an occluder made elsewhere."""
    SCENE = "scene"
    """A tree of occluders from a scene of many objects."""
    TRADEOFF = "tradeoff"
    """What more time buys on a mesh: a measurement at many settings, and no run of its asset."""
    VISIBILITY = "visibility"
    """What may be seen from each view cell of a scene; no run of its asset either."""


class Priority(StrEnum):
    """Which of a tenant's own jobs go first; between tenants there are turns."""

    INTERACTIVE = "interactive"
    """Somebody waits for it."""
    BULK = "bulk"
    """One of many, as a build sends them: behind the others, yet never for ever."""


class JobState(StrEnum):
    """Where a job is.  It enters one of the last three once, and never leaves it."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def ended(self) -> bool:
        return self in (JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED)


@dataclass(frozen=True)
class Failure:
    """Why a job failed.

    ``kind`` is stable, for programs: ``unreadable-mesh``, ``invalid-options``,
    ``invalid-overrides``, ``out-of-memory``, ``out-of-time``, ``process-died``, ``disk-full``,
    ``upload-lost``, ``unavailable`` or ``internal-error``.
    ``detail`` and ``remedy`` are sentences without a full stop.
    """

    kind: str
    detail: str
    remedy: str = ""


@dataclass(frozen=True)
class Blob:
    """Bytes in the blob store: the SHA-256 of them in hex, and how many."""

    digest: str
    size: int


@dataclass(frozen=True)
class JobFile:
    """A file of a job, by a name of ours, unique within the job, with forward slashes.

    Inputs: ``input/mesh.glb``, ``input/occluder.obj``, ``input/scene.glb`` and so on, and
    :data:`OVERRIDES_FILE`.  Results: ``occluder.glb`` with all levels, ``lod0.glb``,
    ``lod0.obj``... one by one, ``report.json``, ``report.html``, ``pictures/silhouettes.png``...;
    ``levels.npz`` where little is kept.

    ``label``  of an input, what its owner calls it, for people only; None where it is not known.
    """

    name: str
    blob: Blob
    media_type: str
    is_input: bool = False
    label: str | None = None


def inputs_by_part(files: Iterable[JobFile]) -> dict[str, JobFile]:
    """A job's inputs by the part that they came as: ``mesh``, ``occluder``, ``overrides``..."""
    return {PurePosixPath(file.name).stem: file for file in files if file.is_input}


JOURNALS = "journals"
"""The folder beside that of work under way, for what outlives an attempt."""

OVERRIDES_FILE = "input/overrides.toml"
"""The input that holds overrides of the mesh, where there are some."""

THUMBNAIL = "thumbnail.png"
"""The result by which a run is told from others in a list."""


@dataclass(frozen=True)
class Summary:
    """The numbers of a result that lists and histories show; None where the kind has none.

    ``precision``, ``recall``  of the finest level, 0 to 1; ``worst_recall`` in its worst view.
    ``overhang``        in the mean over all views; ``verdict`` on it in a word, with the ``reason``
                        and the command to ``try_next``.  Jobs of before they were kept have none.
    ``triangles``       of the finest occluder (of all occluders, for a scene; of the setting that
                        recalls most, as precision and recall, for a trade-off; 0 for visible sets).
    ``levels``          of detail (occluders, for a scene; settings, for a trade-off; view cells,
                        for visible sets).
    ``error_bound``     of the finest, world units.
    ``seconds``         that the work took; ``timings`` by stage.
    """

    triangles: int
    input_triangles: int
    levels: int
    seconds: float
    precision: float | None = None
    recall: float | None = None
    worst_recall: float | None = None
    worst_view: int | None = None
    error_bound: float | None = None
    timings: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    overhang: float | None = None
    verdict: str | None = None
    reason: str | None = None
    try_next: str | None = None


@dataclass(frozen=True, kw_only=True)
class JobTerms:
    """What is asked for when a job is submitted, and stays with it.

    A field here, or one of the classes that follow, is a column of the table of jobs by the same
    name: it is stored and read back without further code.

    ``name``      of the file as its owner calls it; for people only, never a path here.
    ``options``   by keyword, resolved and checked, only what JSON can hold.
    ``asset``     whose run it becomes, if any.
    ``attempts``  how often it may be begun, since its process may die.
    ``priority``  its place among the jobs of its tenant; the result is the same.
    ``keep``      which of its files are stored as it ends; others are made on demand.
    ``request_id``  of the request that asked for it, by which logs and webhooks name it.
    ``trace``     of that request, as ``traceparent`` has it; None where nobody traces.
    """

    kind: JobKind
    name: str
    options: Mapping[str, Any]
    version: str
    asset: str | None = None
    webhook: str | None = None
    attempts: int = 3
    priority: Priority = Priority.INTERACTIVE
    keep: Keep = Keep.ALL
    retry_of: str | None = None
    request_id: str | None = None
    trace: str | None = None


@dataclass(frozen=True, kw_only=True)
class Submission(JobTerms):
    """A job as it is asked for.

    ``inputs``    files that are in the blob store already.
    ``may_reuse`` whether a stored result of the same work will do.
    """

    tenant: str
    inputs: tuple[JobFile, ...]
    may_reuse: bool = True

    @property
    def work_key(self) -> str:
        """Equal for the same work: kind, inputs, options and version."""
        return _hash([self.version, self._work])

    @property
    def fingerprint(self) -> str:
        """Equal for the same request, whatever version it comes to: what is asked, and for whom."""
        return _hash([self._work, self.name, self.asset, self.webhook, self.retry_of])

    @property
    def _work(self) -> list[object]:
        inputs = sorted((one.name, one.blob.digest) for one in self.inputs)
        return [self.kind, inputs, dict(self.options)]


def _hash(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class JobFacts(JobTerms):
    """What there is to know of a job wherever it is looked at, here or over the wire.

    ``asset``, ``asset_id``  whose run it is, if any.
    ``attempt``  how often it was begun; ``attempts`` how often it may be.
    ``reused``   the job whose stored result it was given, if any.
    """

    id: str
    state: JobState
    attempt: int
    asset_id: str | None = None
    failure: Failure | None = None
    summary: Summary | None = None
    reused: str | None = None


@dataclass(frozen=True, kw_only=True)
class Job(JobFacts):
    """A job as it is stored.

    ``number``   rises with every job, whatever the clock does: the order of lists.
    """

    number: int
    tenant: str
    created: float
    started: float | None = None
    ended: float | None = None
    cancel_asked: bool = False


@dataclass(frozen=True)
class Claim:
    """A job that its holder may work at until the lease runs out.

    ``job.attempt`` is the fence: what a holder with an older one says is not heard.
    """

    job: Job
    owner: str
    inputs: tuple[JobFile, ...]
