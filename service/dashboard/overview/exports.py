"""All assets as the browser and as spreadsheets take them.

Rows for the browser are made once for all pages that show the same.  They do not go by NiceGUI's
socket, which would keep megabytes for each open page.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import math
from collections.abc import Collection, Iterable
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response

from service.dashboard.overview.asset_lines import (
    AssetLine,
    Overview,
    midnight,
    shared_overview,
)
from service.dashboard.overview.attention import matters
from service.errors import BadRequestError
from service.routes.services import Reader, TheServices

SOURCE = str(Path(__file__).with_name("source"))
"""The module that fetches them."""

_PATH = "/dashboard/assets.json"
router = APIRouter(include_in_schema=False)

_COLUMNS = (
    "asset", "verdict", "precision", "recall", "worst_recall", "worst_view", "overhang",
    "input_triangles", "triangles", "seconds", "min_precision", "min_recall", "max_overhang",
    "thresholds", "latest_run", "asset_id",
)  # fmt: skip
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def rows_address(since: datetime, number: int) -> str:
    """The address of the rows; another ``number`` makes the browser fetch them anew."""
    return f"{_PATH}?{urlencode({'since': since.date().isoformat(), 'number': number})}"


# Not async: it may wait for the database.
@router.get(_PATH)
def rows_of_all(since: str, request: Request, services: TheServices, caller: Reader) -> Response:
    """Rows by urgency and name; ``since`` decides which of them got worse."""
    try:
        day = midnight(since)
    except ValueError:
        raise BadRequestError(f"'{since}' is not a date", remedy="write it as 2024-05-01") from None
    packed = _pack(shared_overview(services.assets, caller.tenant, day))
    headers = {"Cache-Control": "no-store", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, 200, {**headers, "Content-Encoding": "gzip"}, "application/json")
    return Response(gzip.decompress(packed), 200, headers, "application/json")


@lru_cache(maxsize=4)
def _pack(overview: Overview) -> bytes:
    text = json.dumps(rows_of(overview), separators=(",", ":"))
    return gzip.compress(text.encode(), compresslevel=6)


def rows_of(overview: Overview, most: int | None = None) -> dict[str, Any]:
    """What the browser is told, first what needs attention: names of columns, and rows.

    ``most``  rows; None for all.
    """
    worse = {change.line.id for change in overview.worse}
    places = {matter.address: place for place, matter in enumerate(matters(overview))}

    def urgency(line: AssetLine) -> tuple[int, int]:
        never_run = line.latest is None
        return places.get(f"/assets/{line.id}", len(places)), 0 if never_run else 1

    urgent_first = sorted(overview.lines, key=urgency)
    return {
        "names": _NAMES,
        "rows": [_row(line, worse) for line in urgent_first[:most]],
    }


_NAMES = (
    "id", "name", "job", "pictured", "failed", "holds", "verdict", "precision", "recall",
    "recalls", "worst", "worstView", "overhang", "input", "triangles", "seconds", "created",
    "worse", "evaluation",
)  # fmt: skip


def _row(line: AssetLine, worse: Collection[str]) -> list[Any]:
    """A name, words of ours, and numbers, of no more digits than are shown."""
    run = line.latest
    recalls = [round(recall, 3) for recall in line.recalls]
    if run is None:
        return [
            line.id, line.name, None, False, line.failed, line.holds, None, None, None, recalls,
            *[None] * 7, False, False,
        ]  # fmt: skip
    return [
        line.id, line.name, run.job_id, run.pictured, line.failed, line.holds, run.verdict,
        _at_least(run.precision), _at_least(run.recall), recalls, _at_least(run.worst_recall),
        run.worst_view, _at_most(run.overhang), run.input_triangles, run.triangles,
        round(run.seconds, 3), round(run.created), line.id in worse,
        run.evaluation,
    ]  # fmt: skip


_STEPS = 1e4
"""Parts of a whole that are shown: hundredths of a percent."""


def _at_least(share: float | None) -> float | None:
    """Never more than it is, and nothing only where it is."""
    if share is None:
        return None
    return math.floor(share * _STEPS + 1e-6) / _STEPS or min(share, 0.1 / _STEPS)


def _at_most(share: float | None) -> float | None:
    return None if share is None else math.ceil(share * _STEPS - 1e-6) / _STEPS


def csv_of(lines: Iterable[AssetLine]) -> str:
    """One row an asset; shares are 0 to 1, times ISO 8601 UTC, empty where there is no run."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(_COLUMNS)
    writer.writerows(_csv_row(line) for line in lines)
    return text.getvalue()


def harmless(text: str) -> str:
    """Text with an apostrophe before what a spreadsheet would take for a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def _csv_row(line: AssetLine) -> list[object]:
    run, demanded = line.latest, line.demanded
    numbers: list[object] = [None] * 9
    created = None
    if run is not None:
        numbers = [
            run.verdict, run.precision, run.recall, run.worst_recall, run.worst_view, run.overhang,
            run.input_triangles, run.triangles, run.seconds,
        ]  # fmt: skip
        created = datetime.fromtimestamp(run.created, UTC).isoformat(timespec="seconds")
    return [
        harmless(line.name), *numbers, demanded.min_precision, demanded.min_recall,
        demanded.max_overhang, line.holds, created and created.replace("+00:00", "Z"), line.id,
    ]  # fmt: skip
