"""The page of all assets, in a browser: thousands of them, and names that mean harm."""

from __future__ import annotations

import csv
import io
import re
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, expect

from service.access.key import Scope
from service.jobs.asset import Thresholds
from service.storage.database import Database
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from tests.service.dashboard.accessibility import faint_texts, nameless_controls, tabbed_to
from tests.service.dashboard.chromium import DESKTOP, TABLET, Watch
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.seeding import Past, made_up, seed_assets
from tests.service.dashboard.serving import IDLE, served

MANY = 5000
SLOWEST = 300.0  # milliseconds, for a filter of all of them

HOSTILE = (
    "<script>window.harmed=1</script>",
    "<img src=x onerror=window.harmed=2>",
    '=HYPERLINK("http://evil.example";"x")',
    "{{constructor.constructor('window.harmed=3')()}} ${window.harmed=4} `\\",
    "'\"></textarea></style><script>window.harmed=5</script>",
    "\u202egnp.elgnis\u202c \u05d0\u05d1\u05d2 \u0645\u0631\u062d\u0628\u0627 \U0001f3f0",
    "x" * 300,
)


@dataclass(frozen=True)
class Studio:
    """A service whose people have keys, by tenant."""

    address: str
    database: Database
    keys: dict[str, str]

    def open(self, page: Page, tenant: str) -> None:
        """The overview, signed in."""
        page.context.request.post(
            f"{self.address}/sign-in",
            form={"key": self.keys[tenant]},
            headers={"Origin": self.address},
            max_redirects=0,
        )
        page.goto(self.address)


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    folder = tmp_path_factory.mktemp("data")
    with closing(SqliteDatabase.open(folder / "occluder.db")) as database:
        now, store = time.time(), SqlKeyStore(database)
        seed_assets(database, [Past(name, (0.7, 0.8)) for name in HOSTILE], now, "hostile")
        fallen = Past("props/castle", (0.8,) * 9 + (0.6,), thresholds=Thresholds(None, 0.7))
        steady = Past("props/tower", (0.8,) * 10, thresholds=Thresholds(0.9, 0.5))
        pasts = [fallen, steady, Past("props/new")]
        seed_assets(database, pasts, now, "few")
        seed_assets(database, pasts, now, "guest")
        judged = [
            Past("a/fine", (0.8,)), Past("b/little", (0.0155,)),
            Past("c/old", (0.8,), overhang=None),
        ]  # fmt: skip
        seed_assets(database, judged, now, "limits")
        keys = {
            tenant: store.create(tenant, "artist", Scope.ADMIN)[1]
            for tenant in ("many", "pictured", "hostile", "few", "none", "limits")
        }
        keys["guest"] = store.create("guest", "reader", Scope.READ)[1]
        surroundings = {
            "OCCLUDER_DATA": str(folder),
            "OCCLUDER_REQUIRE_KEYS": "true",
            "OCCLUDER_WORKERS": "1",
            "OCCLUDER_MIN_FREE": "0",
            **IDLE,
        }
        with served("tests.service.dashboard.application:make_app()", surroundings) as address:
            yield Studio(address, database, keys)


@pytest.fixture(scope="module")
def crowded(studio: Studio) -> Studio:
    """With tenants of thousands of assets, which take a second to make up."""
    now = time.time()
    seed_assets(studio.database, made_up(MANY, runs=3), now, "many")
    seed_assets(studio.database, made_up(120, runs=20), now, "pictured")
    return studio


def cell(page: Page, name: str, column: str) -> str:
    row = page.get_by_role("row").filter(has=page.get_by_role("link", name=name, exact=True))
    return row.locator(f"[col-id={column}]").inner_text()


def choose(page: Page, what: str) -> None:
    page.get_by_label("Show").select_option(what)


def filtered(page: Page, typed: str) -> float:
    """Milliseconds from typing to the next picture."""
    taken: float = page.evaluate(
        """async (typed) => {
          const input = document.querySelector("input[type=search]");
          const began = performance.now();
          input.value = typed;
          input.dispatchEvent(new Event("input"));
          await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
          return performance.now() - began;
        }""",
        typed,
    )
    return taken


def test_thousands_of_assets_answer_a_filter_at_once(crowded: Studio, page: Page) -> None:
    crowded.open(page, "many")
    told = page.get_by_text(" shown")
    expect(told).to_have_text(f"{MANY} shown", timeout=15_000)
    for typed, count in (("asset_0123", 10), ("ASSET 99", 95), ("nowhere", 0), ("a", MANY)):
        taken = []
        for _ in range(4):  # of which the fastest: others may have the processors for a moment
            taken.append(filtered(page, typed))
            expect(told).to_have_text(f"{count} shown")
            filtered(page, "")
        assert min(taken) < SLOWEST, f"'{typed}' took {taken} ms"


def test_a_filter_shows_those_whose_names_hold_all_its_words(crowded: Studio, page: Page) -> None:
    crowded.open(page, "many")
    page.get_by_label("Filter by name").fill("props Asset_01")
    links = page.locator(".grid .asset-name")
    expect(links.first).to_have_text(re.compile("props/asset_01"))
    assert all("props/asset_01" in name for name in links.all_inner_texts())
    page.get_by_label("Filter by name").fill("nowhere")
    expect(page.locator(".ag-overlay")).to_contain_text("No asset is like this.")


@pytest.mark.parametrize(
    ("name", "viewport", "scheme"),
    [
        ("dashboard_overview", DESKTOP, "light"),
        ("dashboard_overview_dark", TABLET, "dark"),
    ],
)
def test_the_page_is_kept_as_a_picture(
    crowded: Studio, browser: Browser, tmp_path: Path, name: str, viewport: Any, scheme: Any
) -> None:
    context = browser.new_context(viewport=viewport, color_scheme=scheme)
    try:
        page = context.new_page()
        crowded.open(page, "pictured")
        expect(page.get_by_text("120 shown")).to_be_visible()
        chart = page.locator(".distribution canvas")
        expect(chart).to_be_visible()
        assert colours(chart) > 20
        page.evaluate("scrollTo(0, 0)")
        keep_picture(page, name, tmp_path)
    finally:
        context.close()


def colours(shown: Locator) -> int:
    """How many there are in its picture."""
    found = Image.open(io.BytesIO(shown.screenshot())).convert("RGB").getcolors(1 << 24)
    return len(found or ())


@pytest.mark.parametrize(("size", "scheme"), [(DESKTOP, "light"), (TABLET, "dark")])
def test_texts_are_readable_and_controls_have_names(
    studio: Studio, browser: Browser, watch: Watch, size: Any, scheme: Any
) -> None:
    context = browser.new_context(viewport=size, color_scheme=scheme)
    watch.over(context)
    page = context.new_page()
    try:
        studio.open(page, "few")
        expect(page.get_by_text("3 shown")).to_be_visible()
        assert faint_texts(page) == []
        assert nameless_controls(page) == []
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.get_by_role("button", name="Set the thresholds of props/new").click()
        expect(page.get_by_label("Least recall, %")).to_be_visible()
        assert faint_texts(page) == []
        assert nameless_controls(page) == []
    finally:
        context.close()
    watch.check()


@pytest.mark.vital
def test_names_that_mean_harm_stay_names(studio: Studio, page: Page) -> None:
    studio.open(page, "hostile")
    expect(page.get_by_text(f"{len(HOSTILE)} shown")).to_be_visible()
    assert sorted(page.locator(".grid .asset-name").all_text_contents()) == sorted(HOSTILE)
    for name in HOSTILE:
        button = page.locator(".grid button", has_text="Set").and_(
            page.get_by_label(f"Set the thresholds of {name}", exact=True)
        )
        button.dispatch_event("click")
        dialog = page.get_by_role("dialog")
        expect(dialog.locator(".name")).to_have_text(name)
        page.keyboard.press("Escape")
        expect(dialog).to_be_hidden()
    page.locator(".distribution canvas").hover(position={"x": 300, "y": 150})
    assert page.evaluate("window.harmed") is None
    assert page.locator("main script, main img").count() == 0


def test_a_key_to_write_is_offered_no_thresholds(studio: Studio, page: Page) -> None:
    _, secret = SqlKeyStore(studio.database).create("few", "build farm", Scope.WRITE)
    replace(studio, keys={**studio.keys, "few": secret}).open(page, "few")
    expect(page.get_by_text("3 shown")).to_be_visible()
    assert page.get_by_label("Set the thresholds of props/tower").count() == 0


def test_a_stricter_threshold_turns_an_asset_red(studio: Studio, page: Page) -> None:
    studio.open(page, "few")
    expect(page.get_by_text("Thresholds missed: 1.")).to_be_visible()
    assert cell(page, "props/tower", "holds") == "held"
    page.get_by_label("Set the thresholds of props/tower").click()
    page.get_by_label("Least recall, %").fill("101")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Between 0 and 100")).to_be_visible()
    page.get_by_label("Least recall, %").fill("85.5")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Thresholds missed: 2.")).to_be_visible()
    red = page.locator(".verdict.bad", has_text="missed")
    expect(red).to_have_count(2)
    choose(page, "missed")
    expect(page.get_by_text("2 shown")).to_be_visible()


def test_overhang_and_verdict_are_columns_and_a_limit_turns_an_asset_red(
    studio: Studio, page: Page
) -> None:
    studio.open(page, "limits")
    expect(page.get_by_text("3 shown")).to_be_visible()
    assert [cell(page, name, "verdict") for name in ("a/fine", "b/little", "c/old")] == [
        "good", "unusable", "",
    ]  # fmt: skip
    assert [cell(page, name, "overhang") for name in ("a/fine", "b/little", "c/old")] == [
        "0.42 %", "0.42 %", "",
    ]  # fmt: skip
    choose(page, "poor")
    expect(page.get_by_text("1 shown")).to_be_visible()
    choose(page, "all")
    page.get_by_label("Set the thresholds of a/fine").click()
    page.get_by_label("Most overhang, %").fill("0.4")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Thresholds missed: 1.")).to_be_visible()
    expect(page.locator("[col-id=holds] .verdict.bad", has_text="missed")).to_have_count(1)


def test_what_got_worse_leads_to_the_comparison(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    worse = page.get_by_role("region", name="What got worse")
    expect(worse.get_by_text("1 asset did.")).to_be_visible()
    expect(worse.get_by_role("row").nth(1)).to_have_text("props/castlerecall80.00 %60.00 %-20.00")
    link = worse.get_by_role("link", name="props/castle").get_attribute("href")
    assert link is not None
    assert link.startswith("/compare?a=")
    choose(page, "worse")
    expect(page.get_by_text("1 shown")).to_be_visible()
    today = time.strftime("%Y-%m-%d", time.gmtime(time.time() + 86_400.0))
    worse.get_by_label("Since").fill(today)
    expect(worse.get_by_text("Nothing did.")).to_be_visible()


def test_new_results_and_assets_appear_by_themselves(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    expect(page.get_by_text("3 shown")).to_be_visible()
    seed_assets(studio.database, [Past("props/late", (0.9,))], time.time(), "guest")
    expect(page.get_by_role("link", name="props/late")).to_be_visible(timeout=10_000)
    expect(page.get_by_text("4 shown")).to_be_visible()


def test_who_may_only_read_is_offered_no_change(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    expect(page.get_by_role("link", name="props/castle").first).to_be_visible()
    assert page.get_by_role("button", name="Set the thresholds").count() == 0


def test_rows_open_by_click_and_by_enter(studio: Studio, page: Page, watch: Watch) -> None:
    watch.expect("404")
    studio.open(page, "few")
    link = page.get_by_role("link", name="props/tower")
    asset = link.get_attribute("href")
    page.get_by_role("row").filter(has=link).locator("[col-id=recall]").click()
    page.wait_for_url(f"{studio.address}{asset}")
    page.goto(studio.address)
    page.get_by_role("row").filter(has=link).locator("[col-id=name]").focus()
    page.keyboard.press("Enter")
    page.wait_for_url(f"{studio.address}{asset}")


def test_a_point_of_the_distribution_opens_its_asset(
    studio: Studio, page: Page, watch: Watch
) -> None:
    watch.expect("404")
    studio.open(page, "few")
    asset = page.get_by_role("link", name="props/tower").get_attribute("href")
    chart = page.locator(".distribution canvas")
    box = chart.bounding_box()
    assert box is not None
    # Precision 99.9 % of 99 to 100 %, recall 80 % of 60 to 100 %, within the margins.
    place = {"x": 62 + 0.9 * (box["width"] - 80), "y": 34 + 0.5 * (box["height"] - 80)}
    chart.click(position=place)  # type: ignore[arg-type]
    page.wait_for_url(f"{studio.address}{asset}")


def test_the_tab_key_comes_by_the_filter_and_the_table(studio: Studio, page: Page) -> None:
    studio.open(page, "few")
    expect(page.get_by_text("3 shown")).to_be_visible()
    names = tabbed_to(page)
    places = [
        next(index for index, name in enumerate(names) if name.startswith(wanted))
        for wanted in ("Skip to", "Overview", "Filter by name", "Columns", "Export", "Asset")
    ]
    assert places == sorted(places)


def test_columns_that_one_chose_are_remembered(studio: Studio, page: Page) -> None:
    studio.open(page, "few")
    header = page.get_by_role("columnheader", name="Worst view")
    expect(header).to_be_visible()
    page.get_by_text("Columns", exact=True).click()
    page.get_by_role("checkbox", name="Worst view").uncheck()
    expect(header).to_be_hidden()
    page.reload()
    expect(page.get_by_text("3 shown")).to_be_visible()
    expect(header).to_be_hidden()


def test_the_csv_has_what_is_shown_and_no_formula(
    studio: Studio, page: Page, tmp_path: Path
) -> None:
    studio.open(page, "hostile")
    page.get_by_label("Filter by name").fill("hyperlink")
    expect(page.get_by_text("1 shown")).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("button", name="Export as CSV").click()
    assert download.value.suggested_filename == "assets.csv"
    download.value.save_as(tmp_path / "assets.csv")
    with (tmp_path / "assets.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["asset"] == f"'{HOSTILE[2]}"
    assert float(row["recall"]) == 0.8


def test_where_there_is_nothing_one_is_told_how_to_begin(studio: Studio, page: Page) -> None:
    studio.open(page, "none")
    expect(page.get_by_role("heading", name="No asset yet")).to_be_visible()
    expect(page.get_by_text(f"{studio.address}/v1/occluders?filename=")).to_be_visible()
    expect(page.get_by_role("link", name="Submit a mesh")).to_be_visible()
    expect(page.locator(".grid")).to_be_hidden()
