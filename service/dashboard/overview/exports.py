"""All assets as the browser and as spreadsheets take them.

Rows for the browser are made once for all pages that show the same.  They do not go by NiceGUI's
socket, which would keep megabytes for each open page.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
from collections.abc import Collection, Iterable, Mapping
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response

from service.dashboard.overview.asset_lines import (
    AssetLine,
    Holds,
    Overview,
    midnight,
    shared_overview,
)
from service.errors import BadRequestError
from service.routes.services import Reader, TheServices

SOURCE = str(Path(__file__).with_name("source"))
"""The module that fetches them."""

_PATH = "/dashboard/assets.json"
_URGENCY = {
    Holds.MISSED: 0,
    Holds.NEVER_RUN: 1,
    Holds.OPEN: 2,
    Holds.HELD: 2,
}

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
        raise BadRequestError(f"'{since}' is no day", remedy="write it as 2024-05-01") from None
    packed = _pack(shared_overview(services.assets, caller.tenant, day))
    headers = {"Cache-Control": "no-store", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, 200, {**headers, "Content-Encoding": "gzip"}, "application/json")
    return Response(gzip.decompress(packed), 200, headers, "application/json")


@lru_cache(maxsize=4)
def _pack(overview: Overview) -> bytes:
    text = json.dumps(rows_of(overview), separators=(",", ":"))
    return gzip.compress(text.encode(), compresslevel=5)


def rows_of(overview: Overview) -> list[Mapping[str, Any]]:
    """What the browser is told, those that miss their thresholds first."""
    worse = {change.line.id for change in overview.worse}
    urgent_first = sorted(overview.lines, key=lambda line: _URGENCY[line.holds])
    return [_row(line, worse) for line in urgent_first]


def _row(line: AssetLine, worse: Collection[str]) -> Mapping[str, Any]:
    """A name, words of ours, and numbers."""
    run = line.latest
    return {
        "id": line.id,
        "name": line.name,
        "holds": str(line.holds),
        "verdict": run and run.verdict,
        "precision": run and run.precision,
        "recall": run and run.recall,
        "recalls": [round(recall, 4) for recall in line.recalls],
        "worst": run and run.worst_recall,
        "worstView": run and run.worst_view,
        "overhang": run and run.overhang,
        "input": run and run.input_triangles,
        "triangles": run and run.triangles,
        "seconds": run and run.seconds,
        "created": run and run.created,
        "worse": line.id in worse,
    }


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
    run, demanded = line.latest, line.thresholds
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
