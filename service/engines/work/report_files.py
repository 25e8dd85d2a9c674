"""The report of an occluder as files, and as the picture and numbers that lists and histories show.

Its pages are drawn with it, or on demand.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Protocol

import simplifier
from service.engines.messages import Task
from service.jobs.job import THUMBNAIL, Summary
from service.jobs.on_demand import PAGES, REPORT
from service.keep import Keep

PICTURE_SIZE = 160
"""Pixels a side of a thumbnail, and of a picture on the way: some 6 KiB."""


class Judged(Protocol):
    """What can be drawn: a product or a judgement."""

    def write_pictures(
        self, folder: str | Path, name: str, report: dict[str, Any] | None = None
    ) -> list[Path]: ...


def write_report(judged: Judged, report: dict[str, Any], task: Task) -> None:
    """Write ``report.json``, and where the task says so ``report.html`` and ``pictures/``.

    Where little is kept it is written without spaces, which are a third of it.  Raises OSError and
    :class:`simplifier.OutputError`.
    """
    results, lean = Path(task.results), task.keep is Keep.LEAN
    form: dict[str, Any] = {"separators": (",", ":")} if lean else {"indent": 2}
    text = json.dumps(report, allow_nan=False, **form) + "\n"
    (results / REPORT).write_text(text, "utf-8")
    if task.pages:
        judged.write_pictures(results / PICTURES, task.name, report)
        part_page(results)


PICTURES = "pictures"
"""The folder of a report's pictures."""


def write_thumbnail(view: simplifier.Viewpoint, finest: simplifier.Occluder, task: Task) -> None:
    """Write the small picture by which lists tell a run from others.  Raises OSError."""
    (Path(task.results) / THUMBNAIL).write_bytes(view.picture(finest))


def part_page(results: Path) -> None:
    """The page holds its pictures itself, and lies beside their folder."""
    (results / PICTURES / "report.html").replace(results / PAGES["report"])


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
