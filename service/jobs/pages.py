"""Pages and pictures of a report: drawn when somebody first asks for them, and kept from then on.

Drawing takes 0.4 s, of jobs that may take as long, and most results of a build are never looked at.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from concurrent.futures import Future
from typing import Protocol

from service.jobs.job import Job, JobKind, JobState

REPORT = "report.json"
FINEST = "lod0.glb"
"""Results that pages are drawn from, beside the mesh that was sent."""

PAGES: Mapping[str, str] = {
    "report": "report.html",
    "silhouettes": "pictures/silhouettes.png",
    "recall": "pictures/recall.png",
    "precision": "pictures/precision.png",
}
"""Files by what they show; the pictures of the views are beside the last three."""

_VIEW = re.compile(r"pictures/view_[0-9]{2}_[a-z0-9_]{1,40}\.png")
_KINDS = (JobKind.OCCLUDER, JobKind.EVALUATION)


def has_pages(kind: JobKind, state: JobState, files: Collection[str]) -> bool:
    """Whether a job's report can be drawn, or is; ``files`` are the names of its files."""
    done = kind in _KINDS and state is JobState.SUCCEEDED
    return done and REPORT in files and FINEST in files


def is_page(name: str) -> bool:
    """Whether a file of this name would be drawn."""
    return name in PAGES.values() or _VIEW.fullmatch(name) is not None


def is_undrawn(job: Job, files: Collection[str], name: str) -> bool:
    """Whether a file is not there, and may be once the job's pages are drawn."""
    if name in files or PAGES["report"] in files or not has_pages(job.kind, job.state, files):
        return False
    return is_page(name)


class PageMaker(Protocol):
    """Draws the pages of jobs."""

    def draw(self, job: Job) -> Future[None]:
        """Done once the pages are files of the job, whoever asked first.

        It ends by :class:`~service.errors.ServiceError` where they cannot be drawn, and raises
        :class:`~service.errors.NotReadyError` where too many are asked for at once.
        """
