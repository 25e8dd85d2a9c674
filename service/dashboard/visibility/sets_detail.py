"""What the page of visible sets shows, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from service.dashboard.view_map import Axis
from service.jobs.job import Job, JobKind, JobState, Summary
from service.jobs.stores import BlobStore, JobStore
from service.routes.results import read_document, read_report

FILE = "sets.pvs"
VIEW = "view/"
"""Begins the names of files that are for the page alone."""
_PAGE = "view/page.json"
_PARTS = ("view/parts.bin", "view/altitudes.bin")

_METHODS = {
    "cull-map": "cull maps",
    "slice-wise": "slices through the scene",
    "voxel-column": "columns of voxels",
    "strong-occluders": "strong occluders",
}


@dataclass(frozen=True)
class LargeSet:
    """A cell with one of the largest sets: how many objects, and the cell's middle in the world."""

    cell: int
    objects: int
    middle: tuple[float, float, float]


@dataclass(frozen=True)
class SetsDetail:
    """A job of visible sets that has succeeded.

    ``report``   what ``occluder pvs --report`` writes.
    ``up``       axis of the scene that points up.
    ``largest``  the cells with the largest sets, in turn.
    ``bytes_``   of the file.
    ``parts``    whether it tells more than which objects are seen: slices, or altitudes.
    """

    job: Job
    summary: Summary
    report: Mapping[str, Any]
    up: Axis
    largest: tuple[LargeSet, ...]
    bytes_: int
    parts: bool

    @property
    def base(self) -> str:
        """Address of what the plan and the 3D view read."""
        return f"/v1/jobs/{self.job.id}/files/{VIEW.rstrip('/')}"

    @property
    def link(self) -> str:
        return f"/v1/jobs/{self.job.id}/files/{FILE}"

    @property
    def bytes_a_cell(self) -> float:
        done: int = self.report["cells"] - self.report["left"]
        return self.bytes_ / max(done, 1)

    @property
    def way(self) -> str:
        """How the sets were found, and why so: a sentence or two."""
        method, reason = self.report["method"], self.report["reason"]
        because = f", {reason}" if reason else ""
        sure = (
            "Nothing that is visible from a cell is missing in its set."
            if self.report["conservative"]
            else "Something visible may be missing where the scene has narrow gaps."
        )
        return f"Found by {_METHODS.get(method, method)}{because}. {sure}"


def read_sets(blobs: BlobStore, jobs: JobStore, job: Job) -> SetsDetail | None:
    """None of another kind, and of a job that has not succeeded.  Waits for database and disk.

    Raises :class:`~service.errors.NotFoundError` where its files are gone.
    """
    if job.kind is not JobKind.VISIBILITY or job.state is not JobState.SUCCEEDED:
        return None
    files = jobs.files(job.id)
    report, page = read_report(blobs, files), read_document(blobs, files, _PAGE)
    assert job.summary is not None, "a job that has succeeded has a summary"
    assert report is not None and page is not None, "and visible sets have both"  # noqa: PT018
    (sets,) = (file for file in files if file.name == FILE)
    largest = tuple(
        LargeSet(one["cell"], one["objects"], tuple(one["middle"])) for one in page["largest"]
    )
    up = cast(Axis, page["up"])
    parts = any(file.name in _PARTS for file in files)
    return SetsDetail(job, job.summary, report, up, largest, sets.blob.size, parts)
