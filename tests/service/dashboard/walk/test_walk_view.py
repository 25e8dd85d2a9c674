"""A walk, played: on the page of a scene's job, which makes it first, and as its own page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from simplifier.culling.flythrough import fly
from simplifier.culling.walk_page import walk_page
from tests.culling.occluded import SMALL, WALL, exact, looking, path_of, street, tree_of
from tests.culling.occluded import wall_with_window as with_window
from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows
from tests.service.dashboard.results import scene_result
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.service.dashboard.viewer_pages import pixels

SLOW = 60_000.0  # milliseconds
ALONE = "http://127.0.0.1:9/walk.html"


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of the page of a scene's job."""
    folder = tmp_path_factory.mktemp("data")
    with stocked(folder) as stock:
        made = stock.run(scene_result(tmp_path_factory.mktemp("town")))
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0", **IDLE
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        yield f"{address}/jobs/{made.id}"


@pytest.fixture(scope="module")
def alone() -> str:
    """A page that ``occluder cull`` writes, of a wall with a window that its occluder closes."""
    scene = street(with_window())
    steps = [looking((0.0, -10.0 + 0.5 * at, 3.0)) for at in range(8)]
    flown = fly(scene, tree_of(scene, {"wall": exact(WALL)}), path_of(*steps), SMALL)
    return walk_page(flown, "street.glb")


def open_alone(page: Page, text: str) -> Locator:
    """The page, once it has drawn its first frame."""
    page.route(ALONE, lambda route: route.fulfill(body=text, content_type="text/html"))
    page.goto(ALONE)
    return drawn(page)


def drawn(page: Page) -> Locator:
    canvas = page.locator("canvas[data-pictures]")
    canvas.wait_for(timeout=SLOW)
    return canvas


def figure(page: Page, name: str) -> Locator:
    return page.locator(".walk-figures div", has_text=re.compile(f"^{name}")).locator("dd")


@pytest.mark.vital
def test_a_page_of_its_own_plays_to_its_end_and_says_what_is_found(page: Page, alone: str) -> None:
    page.emulate_media(reduced_motion="reduce")
    canvas = open_alone(page, alone)
    expect(figure(page, "Frame")).to_have_text("1 of 8")
    before = pixels(page.locator(".walk-stage"))
    page.get_by_label("Speed").select_option("4")
    page.get_by_role("button", name="Play").click()
    expect(canvas).to_have_attribute("data-frame", "7", timeout=SLOW)
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    expect(figure(page, "Wrong")).not_to_have_text("0")
    after = pixels(page.locator(".walk-stage"))
    assert (np.abs(after.astype(int) - before) > 40).any(axis=-1).mean() > 0.02


def test_keys_play_scrub_and_turn(page: Page, alone: str) -> None:
    canvas = open_alone(page, alone)
    scrubber = page.get_by_role("slider", name="Frame of the walk")
    scrubber.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    expect(canvas).to_have_attribute("data-frame", "2")
    assert "objects hidden" in (scrubber.get_attribute("aria-valuetext") or "")
    page.keyboard.press("End")
    expect(canvas).to_have_attribute("data-frame", "7")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    canvas.focus()
    for key in ("ArrowLeft", "+", "-"):
        count = canvas.get_attribute("data-pictures") or ""
        page.keyboard.press(key)
        expect(canvas).not_to_have_attribute("data-pictures", count)


def test_occluders_are_shown_if_wanted(page: Page, alone: str) -> None:
    page.emulate_media(reduced_motion="reduce")
    open_alone(page, alone)
    stage = page.locator(".walk-stage")

    def yellow() -> float:
        shown = pixels(stage).astype(int)
        return float(((shown[..., 0] > 150) & (shown[..., 2] < shown[..., 0] - 50)).mean())

    before = yellow()
    page.get_by_label("Occluders, in yellow").check()
    page.wait_for_timeout(300.0)
    assert yellow() > before + 0.01


def test_the_walk_of_a_job_is_made_when_it_is_asked_for(page: Page, job: str) -> None:
    page.goto(job, timeout=SLOW)
    page.get_by_role("button", name="Show the walk").click()
    drawn(page)
    expect(figure(page, "Frame")).to_have_text("1 of 60")
    expect(page.get_by_role("button", name="Play")).to_be_focused()
    page.get_by_role("button", name="Weakest frame").click()
    expect(figure(page, "Found")).to_contain_text("%")


def test_a_link_shows_the_same_frame_at_the_same_speed(
    browser: Browser, page: Page, job: str
) -> None:
    page.goto(job, timeout=SLOW)
    page.get_by_role("button", name="Show the walk").click()
    drawn(page)
    page.get_by_role("slider", name="Frame of the walk").fill("8")
    page.get_by_label("Speed").select_option("2")
    page.get_by_label("Occluders, in yellow").check()
    expect_kept(page, frame="9", speed="2", shows="occluders", above=None)
    drawn(page).focus()
    page.keyboard.press("ArrowLeft")
    expect(page).to_have_url(re.compile("above="))
    with elsewhere(browser, page) as other:
        drawn(other)
        expect(figure(other, "Frame")).to_have_text("9 of 60")
        expect(other.get_by_label("Speed")).to_have_value("2")
        expect(other.get_by_label("Occluders, in yellow")).to_be_checked()
        expect(other.get_by_label("Found objects through walls")).not_to_be_checked()
    page.goto(f"{job}?frame=1000&speed=9&shows=none&above=x")
    drawn(page)
    expect(figure(page, "Frame")).to_have_text("60 of 60")
    expect(page.get_by_label("Speed")).to_have_value("1")


def test_the_address_of_a_page_of_its_own_tells_its_frame(page: Page, alone: str) -> None:
    open_alone(page, alone)
    page.get_by_role("slider", name="Frame of the walk").fill("4")
    expect(page).to_have_url(f"{ALONE}#frame=5")
    page.reload()
    drawn(page)
    expect(figure(page, "Frame")).to_have_text("5 of 8")


def test_what_cannot_be_had_is_told(page: Page, job: str, watch: object) -> None:
    watch.expect("507")  # type: ignore[attr-defined]
    told = '{"detail": "there is no room for it", "remedy": "free some space"}'
    page.route("**/scene.walk", lambda route: route.fulfill(status=507, body=told))
    page.goto(job, timeout=SLOW)
    page.get_by_role("button", name="Show the walk").click()
    expect(
        page.get_by_text("The walk cannot be shown: there is no room for it; free some space.")
    ).to_be_visible()
    expect(page.get_by_role("button", name="Try again")).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_it_can_be_read(
    browser: Browser, job: str, scheme: str, width: int, tmp_path: Path
) -> None:
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme=scheme,  # type: ignore[arg-type]
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.goto(job, timeout=SLOW)
    page.get_by_role("button", name="Show the walk").click()
    drawn(page)
    page.get_by_role("slider", name="Frame of the walk").fill("26")
    assert faint_texts(page) == []
    assert covered_texts(page) == []
    assert not overflows(page)
    page.wait_for_timeout(500.0)
    if scheme == "light" and width > 1000:
        keep_picture(page, "dashboard_walk", tmp_path)
    context.close()
