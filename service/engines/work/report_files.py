"""The report of an occluder as files and as the numbers that lists and histories show."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Protocol

from service.jobs.job import Summary


class Judged(Protocol):
    """What can be drawn: a product or a judgement."""

    def write_pictures(
        self, folder: str | Path, name: str, report: dict[str, Any] | None = None
    ) -> list[Path]: ...


def write_pages(judged: Judged, report: dict[str, Any], name: str, results: Path) -> None:
    """Write ``report.json``, ``report.html`` and ``pictures/``; the page calls the mesh ``name``.

    Raises OSError and :class:`simplifier.OutputError`.
    """
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    (results / "report.json").write_text(text, "utf-8")
    judged.write_pictures(results / "pictures", name, report)
    # The page holds its pictures itself.
    (results / "pictures" / "report.html").replace(results / "report.html")


def command_names(name: str) -> tuple[str, str]:
    """Of mesh and occluder in a command to try: the mesh as its owner calls it."""
    return name, f"{PurePosixPath(name).stem}_occluder.glb"


def summary_of(report: Mapping[str, Any], levels: int, seconds: float) -> Summary:
    """The numbers of the finest level; ``report`` as ``docs/report.schema.json`` says."""
    worst, verdict = report["worst_view"], report["verdict"]
    return Summary(
        triangles=report["triangles"],
        input_triangles=report["input"]["triangles"],
        levels=levels,
        seconds=seconds,
        precision=report["precision"],
        recall=report["recall"],
        worst_recall=worst["recall"],
        worst_view=worst["index"],
        overhang=report["overhang"]["share"],
        verdict=verdict["word"],
        reason=verdict["reason"],
        try_next=verdict["next"],
        error_bound=report["error_bound"],
        timings=dict(report["timings"]),
        warnings=tuple(report["warnings"]),
    )
