"""The page of visible sets, over a folder that a server has left."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

import simplifier
from service.dashboard.visibility.sets_detail import read_sets
from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows
from tests.service.dashboard.results import JobResult, sets_result
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.service.dashboard.viewer_pages import grey, pixels, settle, shown, yellow

VIEWER = "town.glb, what a cell may see of it"
SLOW = 60_000.0  # milliseconds


@dataclass(frozen=True)
class Town:
    """A job's page, its files, and what the file of sets holds."""

    page: str
    result: JobResult
    pvs: simplifier.Pvs

    @property
    def largest(self) -> list[int]:
        page = json.loads((self.result.folder / "view/page.json").read_text())
        return [one["cell"] for one in page["largest"]]

    def words(self, cell: int) -> str:
        return f"{self.pvs.visible(cell).sum()} of {len(self.pvs.names)} objects may be seen"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> JobResult:
    return sets_result(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="module")
def town(made: JobResult, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Town]:
    folder = tmp_path_factory.mktemp("data")
    with stocked(folder) as stock:
        job = stock.run(made)
        sets = read_sets(stock.blobs, stock.jobs, job)
    assert sets is not None
    assert sets.way.startswith("Found by cull maps, after strong occluders, since 100 %")
    assert sets.bytes_a_cell == (made.folder / "sets.pvs").stat().st_size / sets.summary.levels
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0", **IDLE
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        pvs = simplifier.load_pvs(made.folder / "sets.pvs")
        yield Town(f"{address}/jobs/{job.id}", made, pvs)


def plan_of(page: Page) -> Locator:
    """The plan, drawn."""
    page.locator(".cells-plan[data-state=ready]").wait_for(timeout=SLOW)
    return page.locator(".cells-plan-canvas")


def place_on_screen(town: Town, plan: Locator, cell: int) -> tuple[float, float]:
    """Where the middle of a cell is in the picture of the plan."""
    told = json.loads((town.result.folder / "view/plan.json").read_text())
    corners = np.array([*told["cells"], *told["boxes"]])
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    box = plan.bounding_box()
    assert box is not None
    size = np.array([box["width"], box["height"]]) - 2.0  # less the border
    scale = (size / (1.06 * (high - low))).min()
    middle = np.array(told["cells"][cell]).reshape(2, 2).mean(axis=0)
    x, y = size / 2.0 + scale * (middle - (low + high) / 2.0) * [1.0, -1.0]
    return float(x), float(y)


def shown_sets(folder: Path) -> Iterator[list[int]]:
    """The objects of each cell as the page reads them."""
    plan = json.loads((folder / "view/plan.json").read_text())
    data = (folder / "view/sets.bin").read_bytes()
    for row in plan["rows"]:
        seen: list[int] = []
        place = number = shift = turn = 0
        for byte in data[plan["offsets"][row] : plan["offsets"][row + 1]]:
            number |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                seen += plan["order"][place : place + number] if turn % 2 else []
                place, number, shift, turn = place + number, 0, 0, turn + 1
        yield sorted(seen)


def test_what_the_page_reads_is_what_the_file_holds(made: JobResult) -> None:
    names = {path.relative_to(made.folder).as_posix() for path in made.folder.rglob("*.*")}
    view = {"scene.glb", "plan.json", "sets.bin", "page.json", "names.json"}
    assert names == {"sets.pvs", "report.json", "cells.png", *(f"view/{one}" for one in view)}
    pvs = simplifier.load_pvs(made.folder / "sets.pvs")
    own = [np.flatnonzero(pvs.visible(cell)).tolist() for cell in range(len(pvs.cells))]
    assert list(shown_sets(made.folder)) == own
    plan = json.loads((made.folder / "view/plan.json").read_text())
    assert plan["sizes"] == [len(one) for one in own]
    assert sum(plan["triangles"]) == made.summary.input_triangles
    largest = json.loads((made.folder / "view/page.json").read_text())["largest"][0]
    assert largest["objects"] == max(plan["sizes"])
    assert largest["cell"] in pvs.cells.containing(pvs.to_cells(np.array(largest["middle"])))
    assert list(made.summary.timings) == ["load", "objects", "sets", "write"]
    assert made.report["cells"] == made.summary.levels == len(own)


def test_what_a_cell_sees_is_shown_and_the_file_fetched(page: Page, town: Town) -> None:
    page.set_viewport_size({"width": 720, "height": 700})  # fewer pixels, less time
    page.goto(town.page, timeout=SLOW)
    plan = plan_of(page)
    largest, other = town.largest[0], int(np.argmin([
        town.pvs.visible(cell).sum() for cell in range(len(town.pvs.cells))
    ]))  # fmt: skip
    expect(page.get_by_text(town.words(largest))).to_be_visible(timeout=SLOW)
    x, y = place_on_screen(town, plan, other)
    plan.click(position={"x": x, "y": y})
    expect(page.get_by_text(f"Cell {other}, around")).to_contain_text(town.words(other))
    expect(page.get_by_text(f"What cell {other} may see")).to_be_visible(timeout=SLOW)
    with page.expect_download() as download:
        page.get_by_role("link", name="Download sets.pvs").click()
    assert download.value.path().read_bytes() == (town.result.folder / "sets.pvs").read_bytes()


def test_the_rest_is_hidden_if_wanted_and_tables_choose_cells(page: Page, town: Town) -> None:
    page.goto(town.page, timeout=SLOW)
    host = shown(page, VIEWER)
    ghost = grey(pixels(host))
    page.get_by_role("button", name="Rest hidden").click()
    page.wait_for_timeout(300.0)
    settle(host)
    assert grey(pixels(host)) < 0.5 * ghost
    rows = page.get_by_role("table", name="Cells that see most").locator("tbody tr").all()
    for axis in ("x", "y", "z"):
        told = [row.locator(f"[data-label={axis}]").inner_text() for row in rows]
        assert len({len(one.partition(".")[2]) for one in told}) == 1, told
    before, cell = yellow(pixels(host)), town.largest[-1]
    page.get_by_role("button", name=f"Cell {cell}", exact=True).click()
    expect(page.get_by_text(f"Cell {cell}, around")).to_contain_text(town.words(cell))
    expect(page.get_by_text(f"What cell {cell} may see")).to_be_visible()
    settle(host)
    assert 0.0 < yellow(pixels(host)) < before


def test_keys_go_from_cell_to_cell(page: Page, town: Town) -> None:
    page.goto(town.page, timeout=SLOW)
    plan = plan_of(page)
    plan.focus()
    page.keyboard.press("ArrowLeft")
    words = page.locator(".view-map-words")
    expect(words).not_to_contain_text(f"Cell {town.largest[0]},")
    cell = int(words.inner_text().split()[1].rstrip(","))
    page.keyboard.press("Enter")
    expect(page.get_by_text(f"What cell {cell} may see")).to_be_visible(timeout=SLOW)
    page.keyboard.press("Home")
    expect(words).to_contain_text(f"Cell {town.largest[0]},")
    for key in ("+", "-", "0"):
        drawn = plan.get_attribute("data-frames")
        page.keyboard.press(key)
        expect(plan).not_to_have_attribute("data-frames", drawn or "")


def test_a_link_shows_the_same_cell_from_the_same_place(
    browser: Browser, page: Page, town: Town
) -> None:
    page.goto(town.page, timeout=SLOW)
    plan = plan_of(page)
    cell = town.largest[-1]
    page.get_by_role("button", name=f"Cell {cell}", exact=True).click()
    page.get_by_role("button", name="Rest hidden").click()
    plan.focus()
    page.keyboard.press("+")
    expect_kept(page, cell=str(cell), mode="alone")
    expect(page).to_have_url(re.compile("plan=[-0-9.]+%2C[-0-9.]+%2C1.2"))
    host = shown(page, VIEWER)
    settle(plan)
    drawn, planned = pixels(host), pixels(plan)
    with elsewhere(browser, page) as other:
        plan = plan_of(other)
        expect(other.get_by_text(f"What cell {cell} may see")).to_be_visible(timeout=SLOW)
        settle(plan)
        for now, before in ((pixels(shown(other, VIEWER)), drawn), (pixels(plan), planned)):
            assert (np.abs(now - before).max(axis=-1) > 24).mean() < 0.01
    plan_of(page).focus()
    page.keyboard.press("0")
    expect_kept(page, plan=None)


def test_an_address_may_name_no_cell(page: Page, town: Town) -> None:
    page.goto(f"{town.page}?cell=99999&mode=x&plan=1,2", timeout=SLOW)
    plan_of(page)
    expect(page.get_by_text(town.words(town.largest[0]))).to_be_visible(timeout=SLOW)


def test_what_is_gone_is_told(page: Page, town: Town, watch: Watch) -> None:
    page.route("**/view/plan.json", lambda route: route.fulfill(status=404))
    watch.expect("404")
    page.goto(town.page, timeout=SLOW)
    expect(
        page.get_by_text("The cells cannot be shown: the plan is not there (404).")
    ).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_it_can_be_read(
    browser: Browser, town: Town, scheme: str, width: int, tmp_path: Path
) -> None:
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme=scheme,  # type: ignore[arg-type]
    )
    page = context.new_page()
    page.goto(town.page, timeout=SLOW)
    plan_of(page)
    shown(page, VIEWER)
    assert faint_texts(page) == []
    assert covered_texts(page) == []
    assert not overflows(page)
    if width > 1000:
        name = "dashboard_visible_sets" + ("_dark" if scheme == "dark" else "")
        keep_picture(page, name, tmp_path)
    context.close()
