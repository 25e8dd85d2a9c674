"""How much memory a job will need, as far as its row tells, so that no node is given too much."""

from __future__ import annotations

from collections.abc import Iterable

from service.jobs.job import Job, JobFile
from service.settings import Settings

_GIB = 1 << 30
_PROCESSES = 400 << 20
"""Bytes that the Ray worker and the confined process hold before the job begins."""


def foretold_memory(job: Job, inputs: Iterable[JobFile], settings: Settings) -> int:
    """Bytes, at most what the job may use."""
    own = job.options.get("memory_limit")
    limit = settings.job_memory if own is None else min(int(own * _GIB), settings.job_memory)
    return _PROCESSES + limit
