"""Submitting scenes for their visible sets, as a person does it."""

from __future__ import annotations

from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from bench.visibility_city import generated_city
from service.app import create_app
from service.settings import Settings
from simplifier.io.scene_writer import write_scene
from tests.service.dashboard.chromium import Watch
from tests.service.dashboard.legibility import faint_texts, overflows
from tests.service.dashboard.screenshots import keep_picture
from tests.service.routes.serving import listening

PATIENCE = 120_000.0  # ms: the first job waits until the worker is ready
PAGE = "/submit/visibility"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "town.glb"
    write_scene(generated_city(2), path)
    return path


def choose(page: Page, label: str, option: str) -> None:
    page.get_by_label(label, exact=True).click()
    page.get_by_role("option", name=option, exact=True).click()


def test_the_form_is_there_without_a_browser(tmp_path: Path) -> None:
    settings = Settings(data=tmp_path / "data", workers=1, min_free=0)
    with listening(create_app(settings)) as address:
        told = httpx.get(f"{address}{PAGE}", timeout=30.0)
        meshes = httpx.get(f"{address}/submit", timeout=30.0).text
    assert told.is_success
    words = ("Cell size", "Eye height", "Epsilon", "Slices", "voxel-column", "walkable", "Spacing")
    for word in (*words, "/v1/visibility", "Width of a view cell"):
        assert word in told.text
        assert word not in meshes or word == "Eye height"
    assert "/v1/occluders" in meshes
    assert "/v1/occluders" not in told.text


def test_a_scene_is_submitted_and_its_sets_are_shown(page: Page, working: str, scene: Path) -> None:
    page.goto(f"{working}/submit")
    page.get_by_role("link", name="Visible sets").click()
    page.wait_for_url(f"**{PAGE}")
    page.get_by_label("Scenes").set_input_files(scene)
    choose(page, "Method", "cull-map")
    choose(page, "Up", "z")
    page.get_by_label("Cell size", exact=True).fill("20")
    page.get_by_role("checkbox", name="Slices").click()
    page.get_by_role("button", name="Submit").click()
    job = page.get_by_role("region", name="Job").first
    expect(job.get_by_role("status")).to_have_text("succeeded", timeout=PATIENCE)
    job.get_by_role("link", name="See the visible sets").click()
    expect(page.get_by_text("Found by cull maps")).to_be_visible(timeout=PATIENCE)
    page.get_by_role("link", name="Run again with other settings").click()
    expect(page.get_by_text("The scene of")).to_be_visible()
    expect(page.get_by_label("Cell size", exact=True)).to_have_value("20")
    expect(page.get_by_role("checkbox", name="Slices")).to_be_checked()
    page.goto(f"{working}{PAGE}")  # kept apart from what is kept for meshes
    expect(page.get_by_label("Cell size", exact=True)).to_have_value("20")


def test_what_is_wrong_is_told_beside_its_field_and_by_the_service(
    page: Page, working: str, scene: Path, watch: Watch, tmp_path: Path
) -> None:
    page.goto(f"{working}{PAGE}")
    page.get_by_label("Scenes").set_input_files(scene)
    page.get_by_label("Cell size", exact=True).fill("-1")
    expect(page.get_by_text("-1.0 is out of range. Choose a number above 0.")).to_be_visible()
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_label("Cell size", exact=True)).to_be_focused()
    expect(page.get_by_role("region", name="Job")).to_have_count(0)
    page.get_by_label("Cell size", exact=True).fill("10")
    send = page.get_by_role("button", name="Submit")
    other = tmp_path / "town.overrides.toml"  # goes along with meshes alone
    other.write_text("")
    page.get_by_role("button", name="Remove town.glb").click()
    page.get_by_label("Scenes").set_input_files(other)
    expect(page.get_by_role("row", name=other.name).get_by_role("alert")).to_be_visible()
    expect(send).to_be_disabled()
    watch.expect("413")
    large = tmp_path / "large.glb"
    large.write_bytes(b"#" * 1_100_000)
    page.get_by_label("Scenes").set_input_files(large)
    send.click()
    expect(page.get_by_role("row", name=large.name).get_by_role("alert")).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1440, 390])
def test_it_can_be_read(
    browser: Browser, working: str, scheme: str, width: int, tmp_path: Path
) -> None:
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme=scheme,  # type: ignore[arg-type]
    )
    page = context.new_page()
    page.goto(f"{working}{PAGE}")
    page.get_by_text("More settings").click()
    expect(page.get_by_label("Spacing", exact=True)).to_be_visible()
    assert faint_texts(page) == []
    assert not overflows(page)
    if width > 1000 and scheme == "light":
        page.mouse.move(0, 0)
        page.wait_for_timeout(500.0)  # until all of it is unfolded
        keep_picture(page, "dashboard_submit_visible_sets", tmp_path)
    context.close()
