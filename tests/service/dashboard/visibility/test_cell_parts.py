"""Slices and altitudes on the page of visible sets."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

import simplifier
from service.dashboard.visibility.sets_detail import read_sets
from tests.service.dashboard.legibility import faint_texts, overflows
from tests.service.dashboard.results import JobResult, sets_result, terrain_result
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.service.dashboard.viewer_pages import shown

SLOW = 20_000.0  # milliseconds
MORE = "What is drawn of its objects"


@pytest.fixture(scope="module")
def sliced(tmp_path_factory: pytest.TempPathFactory) -> JobResult:
    return sets_result(
        tmp_path_factory.mktemp("sliced"), method="cull-map", slices=True, cell_size=25.0
    )


@pytest.fixture(scope="module")
def ridge(tmp_path_factory: pytest.TempPathFactory) -> JobResult:
    return terrain_result(tmp_path_factory.mktemp("ridge"))


@pytest.fixture(scope="module")
def pages(
    sliced: JobResult, ridge: JobResult, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[str, str]]:
    """The addresses of both jobs."""
    folder = tmp_path_factory.mktemp("data")
    with stocked(folder) as stock:
        jobs = [stock.run(one) for one in (sliced, ridge)]
        for job in jobs:
            sets = read_sets(stock.blobs, stock.jobs, job)
            assert sets is not None
            assert sets.parts
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0", **IDLE
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        first, second = (f"{address}/jobs/{job.id}" for job in jobs)
        yield first, second


def largest(result: JobResult) -> int:
    told = json.loads((result.folder / "view/page.json").read_text())
    return int(told["largest"][0]["cell"])


def test_what_the_page_reads_of_parts_is_what_the_files_hold(
    sliced: JobResult, ridge: JobResult
) -> None:
    pvs = simplifier.load_pvs(sliced.folder / "sets.pvs")
    assert pvs.slices is not None
    plan = json.loads((sliced.folder / "view/plan.json").read_text())
    assert plan["altitudes"] is None
    assert plan["slices"] == {"count": 8, "starts": pvs.slices.starts.tolist()}
    values = np.frombuffer((sliced.folder / "view/parts.bin").read_bytes(), np.int8).reshape(-1, 3)
    np.testing.assert_array_equal(values, pvs.slices.values)
    assert json.loads((sliced.folder / "view/names.json").read_text()) == list(pvs.names)

    pvs = simplifier.load_pvs(ridge.folder / "sets.pvs")
    assert pvs.altitudes is not None
    plan = json.loads((ridge.folder / "view/plan.json").read_text())
    assert plan["slices"] is None
    numbers = np.frombuffer((ridge.folder / "view/altitudes.bin").read_bytes(), "<u2")
    np.testing.assert_array_equal(numbers.reshape(len(pvs.cells), -1), pvs.altitudes.values)
    assert plan["altitudes"]["low"] == pvs.altitudes.low + pvs.origin[2]
    assert (numbers > 0).any()


def test_the_slices_of_the_chosen_cell_are_told_and_cut_the_scene(
    page: Page, pages: tuple[str, str], sliced: JobResult
) -> None:
    page.goto(pages[0], timeout=SLOW)
    cell, pvs = largest(sliced), simplifier.load_pvs(sliced.folder / "sets.pvs")
    panel = page.get_by_role("region", name=MORE)
    objects, ranges = np.flatnonzero(pvs.visible(cell)), pvs.drawn(cell)
    partly = (ranges[objects] != (1, 8)).any(axis=2).all(axis=1)
    words = f"Of the {len(objects)} objects that cell {cell} may see, {partly.sum()} are drawn in"
    expect(panel.get_by_text(words)).to_be_visible(timeout=SLOW)
    one = int(objects[partly][0])
    row = panel.get_by_role("row", name=pvs.names[one])
    told = [
        f"{low} to {high}" if low < high else f"{low}" if low == high else "none"
        for low, high in ranges[one].tolist()
    ]
    for text, cell_of_it in zip(told, row.get_by_role("cell").all()[1:], strict=True):
        expect(cell_of_it).to_have_text(text)
    boxes = row.locator(".slice-bar .drawn")
    expect(boxes).to_have_count(int(np.maximum(ranges[one, :, 1] - ranges[one, :, 0] + 1, 0).sum()))
    # A triangle of a box building is left out only if all of it is in the block that is hidden.
    shown(page, "town.glb, what a cell may see of it")
    drawn = page.get_by_text(re.compile(rf"What cell {cell} may see: yellow, [\d,]+ of"))
    count = int(re.search(r"yellow, ([\d,]+) of", drawn.inner_text())[1].replace(",", ""))  # type: ignore[index]
    assert count == sum(12 - left_out(pvs, cell, index) for index in objects.tolist())
    assert count < 12 * len(objects)
    page.locator(".cells-plan-canvas").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    expect(panel.get_by_text(words)).to_have_count(0, timeout=SLOW)


def left_out(pvs: simplifier.Pvs, cell: int, index: int) -> int:
    """How many triangles of a box lie in what no slice draws: two for each side that does."""
    ranges = pvs.drawn(cell)[index].tolist()
    if [1, 8] in ranges:
        return 0
    sides = 0
    for axis, (low, _) in enumerate(ranges):
        # The block reaches to one side along this axis, and to both along those that draw none.
        others = [one for at, one in enumerate(ranges) if at != axis]
        if all(one == [1, 0] for one in others):
            sides += 2 if [low, _] == [1, 0] else 1
    return 2 * sides


def test_altitudes_of_tiles_are_told(page: Page, pages: tuple[str, str], ridge: JobResult) -> None:
    page.goto(pages[1], timeout=SLOW)
    panel = page.get_by_role("region", name=MORE)
    expect(panel.get_by_text("are seen only from higher up")).to_be_visible(timeout=SLOW)
    pvs, cell = simplifier.load_pvs(ridge.folder / "sets.pvs"), largest(ridge)
    assert pvs.altitudes is not None
    objects = np.flatnonzero(pvs.visible(cell))
    numbers = pvs.altitudes.values[cell][objects]
    high = int(objects[np.flatnonzero(numbers)[0]])
    height = pvs.altitudes.low + pvs.altitudes.step * pvs.altitudes.values[cell, high]
    height += pvs.origin[2]
    row = panel.get_by_role("row", name=pvs.names[high])
    # To three places.
    expect(row.get_by_role("cell").last).to_have_text(f"{round(height, 3):g}")
    low = int(objects[np.flatnonzero(numbers == 0)[0]])
    row = panel.get_by_role("row", name=pvs.names[low])
    expect(row.get_by_role("cell").last).to_have_text("any height")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1440, 390])
def test_it_can_be_read(
    browser: Browser, pages: tuple[str, str], scheme: str, width: int, tmp_path: Path
) -> None:
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme=scheme,  # type: ignore[arg-type]
    )
    page = context.new_page()
    page.goto(pages[0], timeout=SLOW)
    panel = page.get_by_role("region", name=MORE)
    panel.get_by_role("row").nth(1).wait_for(timeout=SLOW)
    assert faint_texts(page) == []
    assert not overflows(page)
    panel.scroll_into_view_if_needed()
    if (width, scheme) == (1440, "light"):
        keep_picture(panel, "dashboard_slices", tmp_path)
    context.close()
