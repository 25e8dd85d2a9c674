"""The report of an occluder as files: JSON, a page, and pictures in a folder beside them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Protocol


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
