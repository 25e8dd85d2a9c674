"""What is chosen on the pages of assets and comparisons stands in their addresses."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from service.jobs.asset import Thresholds
from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.service.dashboard.viewer_pages import kinds, pixels, settle, shown

_VIEWER = "castle.ply, original and occluder"
_RUNS = 12


@dataclass(frozen=True)
class Runs:
    """The address of an asset with more runs than a table lists at once, and their jobs."""

    asset: str
    compare: str
    jobs: tuple[str, ...]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, castle: JobResult) -> Iterator[Runs]:
    folder = tmp_path_factory.mktemp("data")
    with stocked(folder) as stock:
        jobs = tuple(stock.run(castle, asset="props/castle").id for _ in range(_RUNS))
        asset = stock.demand("props/castle", Thresholds())
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0", **IDLE
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        compare = f"{address}/compare?a={jobs[0]}&b={jobs[1]}"
        yield Runs(f"{address}/assets/{asset}", compare, jobs)


@pytest.fixture(autouse=True)
def small(page: Page) -> None:
    """Pictures are drawn by the processor: fewer pixels, less time."""
    page.set_viewport_size({"width": 720, "height": 700})


def test_a_link_shows_the_same_mode_level_and_slider(
    browser: Browser, page: Page, runs: Runs, castle: JobResult
) -> None:
    page.goto(runs.asset)
    shown(page, _VIEWER)
    page.get_by_role("button", name="Slider").click()
    page.get_by_role("slider", name="Original to the left").fill("0.25")
    page.get_by_role("switch", name="Wireframe").click()
    page.get_by_label("Level of detail").click()
    page.get_by_role("option", name="Level 1").click()
    expect_kept(page, mode="wipe", share="0.25", wireframe="on", level="1")
    expect(page.get_by_text("Level 1: ")).to_be_visible()
    level = f"Occluder: {len(castle.occluder(1).faces)}, yellow"
    expect(page.get_by_text(level)).to_be_visible()
    drawn = pixels(shown(page, _VIEWER))
    with elsewhere(browser, page) as other:
        expect(other.get_by_text(level)).to_be_visible()
        host = shown(other, _VIEWER)
        expect(other.get_by_role("button", name="Slider")).to_have_attribute("aria-pressed", "true")
        expect(other.get_by_label("Level of detail")).to_have_value(re.compile("Level 1"))
        expect(other.get_by_role("switch", name="Wireframe")).to_be_checked()
        expect(other.get_by_text("Level 1: ")).to_be_visible()
        # How bright a wire is, is a matter of chance: its surface has no side to the light.
        covered = (np.ptp(one, axis=-1) > 24 for one in (pixels(host), drawn))
        assert np.not_equal(*covered).mean() < 0.005
    page.get_by_role("button", name="Overlay").click()
    expect_kept(page, mode=None, level="1")


def test_a_link_shows_the_chosen_view_and_what_the_map_is_coloured_by(
    browser: Browser, page: Page, runs: Runs, castle: JobResult
) -> None:
    page.goto(runs.asset)
    shown(page, _VIEWER)
    page.get_by_role("button", name="Precision").click()
    worst = page.get_by_role("table", name="Views of the worst precision").get_by_role("button")
    name = worst.first.inner_text()
    worst.first.click()
    expect_kept(page, view=name.split()[-1], mode="silhouette", by="precision")
    words = page.get_by_text(re.compile(f"{name}, from .*: recall .*finest"))
    expect(words).to_be_visible()
    drawn = kinds(pixels(shown(page, _VIEWER)))
    with elsewhere(browser, page) as other:
        host = shown(other, _VIEWER)
        expect(other.get_by_text(words_of := words.inner_text())).to_be_visible()
        assert words_of.startswith(name)
        chosen = other.get_by_role("listbox", name="Views by precision")
        expect(chosen.locator("[aria-selected=true]")).to_have_attribute(
            "aria-label", re.compile(f"{name},")
        )
        assert (kinds(pixels(host)) == drawn).mean() > 0.99


def test_a_link_shows_it_from_the_same_place(browser: Browser, page: Page, runs: Runs) -> None:
    page.goto(runs.asset)
    host = shown(page, _VIEWER)
    expect_kept(page, eye=None)
    host.focus()
    for key in ("ArrowLeft", "ArrowLeft", "ArrowUp", "+", "+"):
        page.keyboard.press(key)
    expect(page).to_have_url(re.compile("eye="))
    settle(host)
    drawn = pixels(host)
    page.get_by_role("button", name="See-through").click()
    page.get_by_role("button", name="Overlay").click()
    page.wait_for_timeout(400.0)
    assert _alike(pixels(shown(page, _VIEWER)), drawn)  # another mode does not move it
    with elsewhere(browser, page) as other:
        assert _alike(pixels(shown(other, _VIEWER)), drawn)
    host.focus()
    page.keyboard.press("ArrowLeft")
    settle(host)
    assert not _alike(pixels(host), drawn)
    page.keyboard.press("0")
    expect_kept(page, eye=None)


def test_side_by_side_and_back_shows_as_much_as_before(page: Page, runs: Runs) -> None:
    page.goto(runs.asset)
    drawn = pixels(shown(page, _VIEWER))
    page.get_by_role("button", name="Side by side").click()
    settle(page.get_by_role("application", name=_VIEWER, exact=True))
    page.get_by_role("button", name="Overlay").click()
    expect(page.get_by_role("button", name="Overlay")).to_have_attribute("aria-pressed", "true")
    page.wait_for_timeout(400.0)
    assert _alike(pixels(shown(page, _VIEWER)), drawn)


def test_an_address_that_names_nothing_there_is_shows_the_page_as_it_begins(
    page: Page, runs: Runs
) -> None:
    page.goto(
        f"{runs.asset}?mode=<script>&level=9&view=x&by=1&share=much&eye=1,2&chosen=,&page=99&sort=y"
    )
    shown(page, _VIEWER)
    expect(page.get_by_role("button", name="Overlay")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_label("Level of detail")).to_have_value(re.compile("Level 0"))
    expect(page.get_by_text("Choose two runs to compare them.")).to_be_visible()


def test_a_link_shows_the_same_runs_of_the_history(
    browser: Browser, page: Page, runs: Runs
) -> None:
    page.goto(runs.asset)
    table = page.locator(".history")
    table.get_by_role("checkbox", name=re.compile("Choose the run of")).first.click()
    expect_kept(page, chosen=runs.jobs[-1])
    table.get_by_role("button", name="Next page").click()
    expect_kept(page, page="2")
    expect(table.locator("tbody tr")).to_have_count(_RUNS - 10)
    table.get_by_role("columnheader", name="Run (UTC)").click()
    expect_kept(page, sort="when", page=None)  # another order begins with its first page
    table.get_by_role("button", name="Next page").click()
    expect_kept(page, page="2")
    with elsewhere(browser, page) as other:
        listed = other.locator(".history tbody tr")
        expect(listed).to_have_count(_RUNS - 10)
        listed.get_by_role("checkbox", checked=False).first.click()
        other.get_by_role("button", name="Compare the two").click()
        other.wait_for_url("**/compare?a=*&b=*")
        assert parse_qs(urlsplit(other.url).query)["b"] == [runs.jobs[-1]]


def test_a_link_shows_the_same_comparison(browser: Browser, page: Page, runs: Runs) -> None:
    page.goto(runs.compare)
    page.locator(".mesh-viewer[data-state=ready]").nth(1).wait_for(timeout=20_000)
    page.get_by_role("button", name="Side by side").nth(1).click()
    page.get_by_label("Level of detail").first.click()
    page.get_by_role("option", name="Level 1").click()
    expect_kept(page, mode_a=None, mode_b="side", level_a="1", level_b=None)
    with elsewhere(browser, page) as other:
        pressed = other.locator(".q-btn[aria-pressed=true]")
        expect(pressed).to_have_text(["Silhouettes", "Side by side"])
        levels = other.get_by_label("Level of detail")
        expect(levels.first).to_have_value(re.compile("Level 1"))
        expect(levels.nth(1)).to_have_value(re.compile("Level 0"))


def _alike(picture: object, other: object) -> bool:
    """But for what is smoothed at edges and corners, of which a castle has many."""
    return bool((np.abs(np.subtract(picture, other)).max(axis=-1) > 24).mean() < 0.01)
