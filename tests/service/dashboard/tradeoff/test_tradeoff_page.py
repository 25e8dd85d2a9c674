"""A sweep that is run in a real browser."""

from __future__ import annotations

import re
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.chromium import TABLET
from tests.service.dashboard.legibility import faint_texts, overflows
from tests.service.dashboard.meshes import castle_file
from tests.service.dashboard.screenshots import keep_picture

TINY = {"Resolutions": "8", "Directions": "4", "Budgets": "8", "Times": "0.05", "Repeats": "1"}
PATIENCE = 60_000.0


@pytest.fixture(scope="module")
def asset(working: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The id of an asset with a run."""
    mesh = castle_file(tmp_path_factory.mktemp("mesh")).read_bytes()
    query = {
        "filename": "castle.obj", "asset": "swept/castle", "preset": "draft", "resolution": 16,
        "lods": 1,
    }  # fmt: skip
    answer = httpx.post(
        f"{working}/v1/occluders", params=query, content=mesh, headers={"Prefer": "wait=60"},
        timeout=60.0,
    )  # fmt: skip
    asset_id: str = answer.json()["job"]["asset"]["id"]
    return asset_id


def fill(page: Page, **more: str) -> None:
    page.get_by_text("Choose the settings").click()
    for label, text in {**TINY, **more}.items():
        page.get_by_label(label, exact=True).fill(text)


def test_a_sweep_is_run_watched_and_laid_over_the_runs(
    browser: Browser, page: Page, working: str, asset: str, tmp_path: Path
) -> None:
    page.goto(f"{working}/tradeoff/{asset}")
    runs = page.get_by_role("table", name="Runs")
    expect(runs.get_by_role("row")).to_have_count(2)
    heading = runs.get_by_role("columnheader", name="Time to make the occluder")
    expect(heading).to_be_visible()
    fill(page)
    page.get_by_role("button", name="Run the sweep", exact=True).click()
    settings = page.get_by_role("table", name="Settings of the sweep")
    expect(settings.get_by_role("row")).to_have_count(7, timeout=PATIENCE)
    expect(settings.get_by_text("on the front").first).to_be_visible()
    expect(page.locator(".tradeoff-chart").get_by_text("sweep, budget 8")).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("link", name="tradeoff.csv").click()
    assert download.value.path().read_text().count("\n") == 7
    page.get_by_role("heading", level=1).scroll_into_view_if_needed()
    keep_picture(page, "dashboard_tradeoff", tmp_path)
    # What is switched off in the legend is off for whoever is sent the link.
    drawn = page.locator(".tradeoff-chart path[fill='#3b82c4']")
    count = drawn.count()
    page.locator(".tradeoff-chart").get_by_text("sweep, budget 8").click()
    expect_kept(page, without="sweep, budget 8")
    assert drawn.count() < count
    with elsewhere(browser, page) as other:
        chart = other.locator(".tradeoff-chart")
        expect(chart.get_by_text("sweep, budget 8")).to_be_visible()
        expect(chart.locator("path[fill='#3b82c4']")).to_have_count(drawn.count())


def test_the_quick_sweep_tells_the_time_left_and_calls_nothing_useless(
    page: Page, working: str, asset: str
) -> None:
    page.goto(f"{working}/tradeoff/{asset}")
    page.get_by_role("button", name="Run the quick sweep").click()
    job = page.get_by_role("region", name="Job")
    expect(job.get_by_text(re.compile(r"about \d+ s left"))).to_be_visible(timeout=PATIENCE)
    expect(job.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    settings = page.get_by_role("table", name="Settings of the sweep")
    expect(settings.get_by_text("time 2 s", exact=True)).to_be_visible()
    measured = page.get_by_role("region", name="What the sweep measured")
    expect(measured.get_by_text("1 case cannot tell whether")).to_be_visible()
    expect(measured.get_by_text("never pay")).to_have_count(0)


def test_a_sweep_is_cancelled(page: Page, working: str, asset: str) -> None:
    page.goto(f"{working}/tradeoff/{asset}")
    fill(page, Times="60", Repeats="100")
    page.get_by_role("button", name="Run the sweep").click()
    job = page.get_by_role("region", name="Job")
    expect(job.get_by_text("running settings")).to_be_visible(timeout=PATIENCE)
    page.reload()  # a sweep that goes on is found again
    expect(job.get_by_text("running settings")).to_be_visible()
    job.get_by_role("button", name="Cancel").click()
    expect(job.get_by_role("status")).to_have_text("cancelled")
    expect(page.get_by_role("button", name="Run the quick sweep")).to_be_enabled()


def test_wrong_lists_are_told_beside_them(page: Page, working: str, asset: str) -> None:
    page.goto(f"{working}/tradeoff/{asset}")
    fill(page, Budgets="8,8")
    expect(page.get_by_text("A value is given twice. Give each once.")).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_can_be_read_on_a_tablet(
    browser: Browser, working: str, asset: str, scheme: str, tmp_path: Path
) -> None:
    context = browser.new_context(viewport=TABLET, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(f"{working}/tradeoff/{asset}")
    expect(page.get_by_role("table", name="Runs")).to_be_visible()
    assert faint_texts(page) == []
    assert not overflows(page)
    keep_picture(page, f"dashboard_tradeoff_{scheme}", tmp_path)
    context.close()
