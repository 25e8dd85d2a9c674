"""What the dashboard's pages cost a browser: ``python -m bench.pages [--only PAGE]``.

    overview, submit, jobs     with 5,000 assets
    asset, job                 of a castle that a real job has made an occluder of

A real server in a temporary folder and a real Chromium that draws without a graphics card, on the
same machine.  Each page is opened by browsers that have never been there, and then anew by the
same ones.  A page's *useful paint* is the first picture in which what people come for is seen: the
first row of a table, the figures of a run.  Bytes are those of the answers as they are sent,
compressed and with their headers; what comes by the page's socket is not among them.
``pages.csv`` holds the figures, ``pages.md`` shows them.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, BrowserContext, Page

from bench.record import Row, told, write_page, write_table
from bench.service_process import Served, served
from bench.times import met
from examples.castle import castle
from service.client import Client
from service.storage.sqlite import SqliteDatabase
from simplifier import Occluder, save
from tests.service.dashboard.chromium import chromium
from tests.service.dashboard.seeding import made_up, seed_assets

RESULTS = Path("bench/results")
ASSETS = 5000
RUNS = 5
VISITS = 5
BYTES_TARGET, PAINT_TARGET = 1e6, 1.5
"""Of the first visit, bytes and seconds; of the pages that :data:`DEMANDED` names."""
DEMANDED = ("overview", "asset")
WINDOW = {"width": 1440, "height": 900}

_QUIET = 1.0  # seconds without a request after which a page has come to rest
_LONGEST = 60.0

_WATCH = """(selector) => {
  const look = () => {
    const shown = document.querySelector(selector);
    if (shown?.checkVisibility()) {
      // The picture that holds it is made after the callbacks of its frame.
      requestAnimationFrame(() => setTimeout(() => (window.usefulPaint = performance.now())));
    } else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""


@dataclass(frozen=True)
class Visited:
    """A page as a browser saw it: seconds until the useful paint, and what was sent for it."""

    seconds: float
    requests: int
    bytes_: int


@dataclass(frozen=True)
class Place:
    """A page, and what people come for, by a selector."""

    name: str
    address: str
    useful: str


def page_rows(visits: int, only: str | None) -> Iterator[Row]:
    """One row a page; medians over the visits."""
    with served(workers=1, min_free=0) as server, chromium() as browser:
        for place in _places(server):
            if only not in (None, place.name):
                continue
            _visit_anew(browser, server, place)  # the server imports and reads what it keeps
            first, again = [], []
            for _ in range(visits):
                one, other = _visit_anew(browser, server, place)
                first.append(one)
                again.append(other)
            yield _row(place, first, again)


def _row(place: Place, first: list[Visited], again: list[Visited]) -> Row:
    paint = statistics.median(one.seconds for one in first)
    size = statistics.median(one.bytes_ for one in first)
    row: dict[str, object] = {
        "page": place.name,
        "kilobytes": size / 1e3,
        "requests": statistics.median(one.requests for one in first),
        "useful_paint_s": paint,
        "slowest_s": max(one.seconds for one in first),
        "again_kilobytes": statistics.median(one.bytes_ for one in again) / 1e3,
        "again_requests": statistics.median(one.requests for one in again),
        "again_useful_paint_s": statistics.median(one.seconds for one in again),
    }
    if place.name in DEMANDED:
        row["target"] = met(size < BYTES_TARGET and paint < PAINT_TARGET)
    return row


def _places(server: Served) -> list[Place]:
    """What there is to visit, in a service that is filled for it."""
    with closing(Client(server.address)) as client:
        mesh = server.folder / "castle.ply"
        made = castle()
        save(Occluder(made.vertices, made.faces), mesh)
        options = {"preset": "draft", "ground": True}
        job = client.wait(client.submit(mesh, options=options, asset="props/castle").id)
        assert job.asset_id is not None, "a run of an asset"
    with closing(SqliteDatabase.open(server.folder / "data" / "occluder.db")) as database:
        seed_assets(database, made_up(ASSETS - 1, runs=RUNS), time.time())
    return [
        Place("overview", "/", ".asset-list .asset-name"),
        Place("asset", f"/assets/{job.asset_id}", ".numbers dd"),
        Place("submit", "/submit", ".drop-zone"),
        Place("jobs", "/jobs", ".plain-table td"),
        Place("job", f"/jobs/{job.id}", ".numbers dd"),
    ]


def _visit_anew(browser: Browser, server: Served, place: Place) -> tuple[Visited, Visited]:
    """By a browser that keeps nothing of earlier visits, and then once more."""
    context = browser.new_context(viewport=WINDOW)  # type: ignore[arg-type]
    try:
        return _visit(context, server, place), _visit(context, server, place)
    finally:
        context.close()


def _visit(context: BrowserContext, server: Served, place: Place) -> Visited:
    page = context.new_page()
    sent = _Sent(page)
    page.add_init_script(f"({_WATCH})({place.useful!r})")
    page.goto(f"{server.address}{place.address}")
    page.wait_for_function("window.usefulPaint !== undefined", timeout=1000.0 * _LONGEST)
    seconds = float(page.evaluate("window.usefulPaint")) / 1000.0
    sent.wait_until_quiet(page)
    page.close()
    return Visited(seconds, sent.requests, sent.bytes_)


class _Sent:
    """What is sent for a page.  What the browser has kept is no request."""

    def __init__(self, page: Page) -> None:
        self.requests, self.bytes_ = 0, 0
        self._last = time.monotonic()
        self._sizes: dict[str, int] = {}
        self._kept: set[str] = set()
        session = page.context.new_cdp_session(page)
        session.on("Network.requestServedFromCache", lambda told: self._kept.add(told["requestId"]))
        session.on("Network.loadingFinished", self._count)
        session.send("Network.enable")

    def _count(self, told: dict[str, object]) -> None:
        size = told["encodedDataLength"]
        assert isinstance(size, int | float)
        if told["requestId"] in self._kept or size == 0:
            return
        self.requests += 1
        self.bytes_ += int(size)
        self._last = time.monotonic()

    def wait_until_quiet(self, page: Page) -> None:
        """Until nothing has come for a while, or it has gone on for too long."""
        end = time.monotonic() + _LONGEST
        while time.monotonic() < min(end, self._last + _QUIET):
            page.wait_for_timeout(50.0)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.pages", description=__doc__)
    parser.add_argument("--only", help="one page by its name")
    parser.add_argument("--visits", type=int, default=VISITS)
    parser.add_argument("--results", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    rows = []
    for row in page_rows(arguments.visits, arguments.only):
        rows.append(row)
        print(told(row), flush=True)
    if arguments.only is None:
        command = " ".join(["python -m bench.pages", *sys.argv[1:]])
        write_table(arguments.results / "pages_visits.csv", rows, command)
        write_page(arguments.results, "pages", ["visits"])


if __name__ == "__main__":
    main()
