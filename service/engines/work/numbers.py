"""The numbers that lists and histories show, from a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.jobs.job import Summary


def summary_of(report: Mapping[str, Any], levels: int, seconds: float) -> Summary:
    """Of the finest level; ``report`` as ``docs/report.schema.json`` says."""
    worst = report["worst_view"]
    return Summary(
        triangles=report["triangles"],
        input_triangles=report["input"]["triangles"],
        levels=levels,
        seconds=seconds,
        precision=report["precision"],
        recall=report["recall"],
        worst_recall=worst["recall"],
        worst_view=worst["index"],
        error_bound=report["error_bound"],
        timings=dict(report["timings"]),
        warnings=tuple(report["warnings"]),
    )
