"""The page of all assets, in a browser: thousands of them, and names that mean harm."""

from __future__ import annotations

import csv
import re
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from service.access.key import Scope
from service.jobs.asset import Thresholds
from service.jobs.job import Failure, JobKind
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from tests.service.dashboard.accessibility import faint_texts, nameless_controls, tabbed_to
from tests.service.dashboard.chromium import DESKTOP, TABLET, Watch
from tests.service.dashboard.legibility import overflows
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.seeding import Past, made_up, seed_assets
from tests.service.dashboard.serving import IDLE, served
from tests.service.storage.samples import submission

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


def fail_uploads(database: Database, tenant: str, assets: Mapping[str, str | None]) -> None:
    """Uploads by the name of the file, each of an asset or of none."""
    store = SqlJobStore(database)
    for name, asset in assets.items():
        asked = submission(name, tenant=tenant, name=name, asset=asset)
        store.submit(asked, 100)
        claim = store.claim("one", 60.0)
        assert claim is not None
        store.fail(claim, Failure("unreadable-mesh", "it ends too soon", "export it"), final=True)


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
        faded = Past("props/faded", (0.8,) * 9 + (0.75,))
        seed_assets(database, [*pasts, faded, Past("props/broken")], now, "guest")
        fail_uploads(database, "guest", {"gate.glb": "props/broken", "loose.glb": None})
        seed_assets(database, [*pasts, Past("town/gate", (0.6,))], now, "changed")
        judged = [
            Past("a/fine", (0.8,)), Past("b/little", (0.0155,)),
            Past("c/old", (0.8,), overhang=None),
        ]  # fmt: skip
        seed_assets(database, judged, now, "limits")
        by_hand = Past("props/by_hand", (0.8, 0.9), kind=JobKind.EVALUATION, seconds=0.867)
        ours = Past("props/ours", (0.8,), seconds=1234.567)
        seed_assets(database, [ours, by_hand], now, "elsewhere")
        keys = {
            tenant: store.create(tenant, "artist", Scope.ADMIN)[1]
            for tenant in (
                "elsewhere",
                "many",
                "pictured",
                "hostile",
                "few",
                "none",
                "limits",
                "changed",
            )
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


def row_of(page: Page, name: str) -> Locator:
    link = page.get_by_role("link", name=name, exact=True)
    return page.get_by_role("table", name="Assets").get_by_role("row").filter(has=link)


def cell(page: Page, name: str, column: str) -> str:
    return row_of(page, name).locator(f"[data-column={column}]").inner_text()


def change(page: Page, name: str, what: str) -> None:
    """What the menu of a row offers."""
    page.get_by_label(f"Change {name}", exact=True).click()
    page.get_by_role("listitem").get_by_text(what, exact=True).click()


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
    expect(told).to_have_text(f"{MANY:,} shown", timeout=15_000)
    for typed, count in (("asset_0123", 10), ("ASSET 99", 95), ("nowhere", 0), ("a", MANY)):
        taken = []
        for _ in range(4):  # of which the fastest: others may have the processors for a moment
            taken.append(filtered(page, typed))
            expect(told).to_have_text(f"{count:,} shown")
            filtered(page, "")
        assert min(taken) < SLOWEST, f"'{typed}' took {taken} ms"


def test_a_filter_shows_those_whose_names_hold_all_its_words(crowded: Studio, page: Page) -> None:
    crowded.open(page, "many")
    page.get_by_label("Search").fill("props Asset_01")
    links = page.locator(".asset-list .asset-name")
    expect(links.first).to_have_text(re.compile("props/asset_01"))
    assert all("props/asset_01" in name for name in links.all_inner_texts())
    page.get_by_label("Search").fill("nowhere")
    expect(page.get_by_text("No assets match.")).to_be_visible()


def test_rows_out_of_sight_are_no_elements_and_come_as_one_scrolls(
    crowded: Studio, page: Page
) -> None:
    crowded.open(page, "many")
    expect(page.get_by_text(f"{MANY:,} shown")).to_be_visible()
    assert page.locator(".asset-row").count() < 200
    page.get_by_role("button", name="Asset", exact=True).click()
    names = page.locator(".asset-list .asset-name")
    expect(names.first).to_have_text("buildings/asset_00001")
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    expect(names.last).to_have_text(re.compile("^vehicles/"))


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
        keep_picture(page, name, tmp_path)
    finally:
        context.close()


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
        change(page, "props/new", "Thresholds")
        expect(page.get_by_label("Minimum recall")).to_be_visible()
        assert faint_texts(page) == []
        assert nameless_controls(page) == []
    finally:
        context.close()
    watch.check()


@pytest.mark.vital
def test_names_that_mean_harm_stay_names(studio: Studio, page: Page) -> None:
    studio.open(page, "hostile")
    expect(page.get_by_text(f"{len(HOSTILE)} shown")).to_be_visible()
    assert sorted(page.locator(".asset-list .asset-name").all_text_contents()) == sorted(HOSTILE)
    for name in HOSTILE:
        change(page, name, "Thresholds")
        dialog = page.get_by_role("dialog")
        expect(dialog.locator(".name")).to_have_text(name)
        page.keyboard.press("Escape")
        expect(dialog).to_be_hidden()
    assert page.evaluate("window.harmed") is None
    assert page.locator("main script, main img").count() == 0


def test_a_key_to_write_is_offered_no_changes(studio: Studio, page: Page) -> None:
    _, secret = SqlKeyStore(studio.database).create("few", "build farm", Scope.WRITE)
    replace(studio, keys={**studio.keys, "few": secret}).open(page, "few")
    expect(page.get_by_text("3 shown")).to_be_visible()
    assert page.get_by_label("Change props/tower").count() == 0
    assert page.get_by_role("button", name="Set thresholds").count() == 0


def test_a_stricter_threshold_turns_an_asset_red(studio: Studio, page: Page) -> None:
    studio.open(page, "few")
    expect(page.get_by_text("Below a threshold: 1.")).to_be_visible()
    assert cell(page, "props/tower", "holds") == "met"
    change(page, "props/tower", "Thresholds")
    page.get_by_label("Minimum recall").fill("101")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Enter 0 to 100")).to_be_visible()
    page.get_by_label("Minimum recall").fill("85.5")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Below a threshold: 2.")).to_be_visible()
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
    choose(page, "")
    change(page, "a/fine", "Thresholds")
    page.get_by_label("Maximum overhang").fill("0.4")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Below a threshold: 1.")).to_be_visible()
    expect(page.locator("[data-column=holds] .verdict.bad", has_text="missed")).to_have_count(1)


def test_what_needs_attention_comes_first_and_leads_to_its_reason(
    studio: Studio, page: Page
) -> None:
    studio.open(page, "guest")
    matters = page.get_by_role("region", name="Needs attention").get_by_role("listitem")
    expect(matters).to_have_count(4)
    texts = [text.replace("\n", " ") for text in matters.all_inner_texts()]
    assert texts[0].startswith("loose.glb The upload of loose.glb failed.")  # the newest
    assert texts[1].startswith("props/broken The upload of gate.glb failed.")
    assert "The mesh cannot be read. It ends too soon." in texts[1]
    assert texts[2:] == [
        "props/castle Recall is 60.00 %, 10.00 points below 70 %.",
        "props/faded Recall fell from 80.00 % to 75.00 %. Compare the runs",
    ]
    link = page.get_by_role("link", name="Compare the runs").get_attribute("href")
    assert link is not None
    assert link.startswith("/compare?a=")
    assert page.locator(".asset-list .asset-name").all_inner_texts()[:3] == [
        "props/broken", "props/castle", "props/faded",
    ]  # fmt: skip
    choose(page, "worse")
    expect(page.get_by_text("2 shown")).to_be_visible()
    tomorrow = time.strftime("%Y-%m-%d", time.gmtime(time.time() + 86_400.0))
    page.get_by_label("Worse since").fill(tomorrow)
    expect(page.get_by_text(re.compile("Got worse since .*: none."))).to_be_visible()
    expect(page).to_have_url(re.compile(f"since={tomorrow}"))
    page.reload()
    expect(page.get_by_text(re.compile("Got worse since .*: none."))).to_be_visible()


def test_a_failed_upload_leads_to_its_job(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    choose(page, "failed")
    expect(page.get_by_text("1 shown")).to_be_visible()
    row_of(page, "props/broken").get_by_role("link", name="Why the latest upload").click()
    expect(page.get_by_text("It ends too soon.").first).to_be_visible()


def test_an_occluder_made_elsewhere_is_told_from_ours(studio: Studio, page: Page) -> None:
    studio.open(page, "elsewhere")
    expect(page.get_by_text("2 shown")).to_be_visible()
    expect(row_of(page, "props/by_hand").get_by_text("evaluation", exact=True)).to_be_visible()
    expect(row_of(page, "props/ours").get_by_text("evaluation", exact=True)).to_have_count(0)


def test_run_times_read_as_on_all_other_pages(studio: Studio, page: Page) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    studio.open(page, "elsewhere")
    expect(page.get_by_text("2 shown")).to_be_visible()
    assert cell(page, "props/by_hand", "seconds") == "867 ms"
    assert cell(page, "props/ours", "seconds") == "1,234.57 s"


@pytest.mark.parametrize("width", [1440, 1280, 820, 390])
def test_a_name_without_a_gap_is_broken(studio: Studio, page: Page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    studio.open(page, "hostile")
    expect(page.get_by_text(f"{len(HOSTILE)} shown")).to_be_visible()
    expect(row_of(page, "x" * 300)).to_be_visible()
    assert not overflows(page)


def test_new_results_and_assets_appear_by_themselves(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    expect(page.get_by_text("5 shown")).to_be_visible()
    seed_assets(studio.database, [Past("props/late", (0.9,))], time.time(), "guest")
    expect(page.get_by_role("link", name="props/late")).to_be_visible(timeout=10_000)
    expect(page.get_by_text("6 shown")).to_be_visible()


def test_who_may_only_read_is_offered_no_change(studio: Studio, page: Page) -> None:
    studio.open(page, "guest")
    expect(page.get_by_role("link", name="props/castle").first).to_be_visible()
    assert page.get_by_role("button", name="Set thresholds").count() == 0
    assert page.get_by_role("checkbox", name="Choose").count() == 0


def test_rows_open_by_click_and_by_enter(studio: Studio, page: Page) -> None:
    studio.open(page, "few")
    link = row_of(page, "props/tower").get_by_role("link", name="props/tower")
    asset = link.get_attribute("href")
    row_of(page, "props/tower").locator("[data-column=recall]").click()
    page.wait_for_url(f"{studio.address}{asset}")
    page.goto(studio.address)
    link.focus()
    page.keyboard.press("Enter")
    page.wait_for_url(f"{studio.address}{asset}")


def test_a_point_of_the_distribution_opens_its_asset(
    studio: Studio, page: Page, watch: Watch
) -> None:
    studio.open(page, "few")
    asset = page.locator(".asset-name", has_text="props/tower").get_attribute("href")
    assert not any("echart" in url for url in watch.requests)  # which is as large as all else
    page.get_by_text("Precision against recall").click()
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
        for wanted in ("Skip to", "Overview", "Search", "Columns", "Export", "Asset")
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
    # Whoever is sent the link sees the same columns, and keeps what they chose themselves.
    link = page.url
    assert "columns=" in link
    assert "worst" not in link
    page.evaluate("localStorage.clear()")
    page.goto(studio.address)
    expect(header).to_be_visible()
    page.goto(link)
    expect(page.get_by_text("3 shown")).to_be_visible()
    expect(header).to_be_hidden()
    page.goto(studio.address)
    expect(header).to_be_visible()


def test_the_csv_has_what_is_shown_and_no_formula(
    studio: Studio, page: Page, tmp_path: Path
) -> None:
    studio.open(page, "hostile")
    page.get_by_label("Search").fill("hyperlink")
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
    expect(page.get_by_role("heading", name="No assets yet")).to_be_visible()
    expect(page.get_by_text(f"{studio.address}/v1/occluders?filename=")).to_be_visible()
    expect(page.get_by_role("link", name="Submit a mesh")).to_be_visible()
    expect(page.locator(".asset-list")).to_be_hidden()
    page.goto(f"{studio.address}/jobs")
    expect(page.get_by_text("No jobs have ended yet.")).to_be_visible()
    page.goto(f"{studio.address}/jobs?state=failed")
    expect(page.get_by_text("No jobs match this filter.")).to_be_visible()


def test_what_is_shown_stands_in_the_address_and_is_there_after_a_reload(
    studio: Studio, page: Page
) -> None:
    studio.open(page, "changed")
    expect(page.get_by_text("4 shown")).to_be_visible()
    page.get_by_role("navigation", name="Folders").get_by_text("props/").click()
    page.get_by_label("Search").fill("t")
    choose(page, "missed")
    page.get_by_role("button", name="Recall", exact=True).click()
    expect(page).to_have_url(f"{studio.address}/?folder=props&find=t&show=missed&sort=recall")
    page.reload()
    expect(page.get_by_text("1 shown")).to_be_visible()
    expect(page.get_by_label("Search")).to_have_value("t")
    expect(page.get_by_role("columnheader", name="Recall ▴")).to_be_visible()


def test_the_link_is_copied(studio: Studio, page: Page) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    studio.open(page, "changed")
    choose(page, "missed")
    page.get_by_role("button", name="Copy link").click()
    expect(page.get_by_text("Copied")).to_be_visible()
    assert page.evaluate("navigator.clipboard.readText()") == f"{studio.address}/?show=missed"


def test_thresholds_of_a_folder_count_for_its_assets(studio: Studio, page: Page) -> None:
    studio.open(page, "changed")
    expect(page.get_by_text("No thresholds set for all assets.")).to_be_visible()
    page.get_by_role("navigation", name="Folders").get_by_text("town/").click()
    page.get_by_role("button", name="Set thresholds of town/").click()
    page.get_by_label("Minimum recall").fill("65")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Thresholds of town/: recall at least 65 %.")).to_be_visible()
    expect(row_of(page, "town/gate").locator(".verdict.bad")).to_have_text("missed")
    change(page, "town/gate", "Thresholds")
    expect(page.get_by_label("Minimum recall")).to_have_attribute("placeholder", "65")
    page.get_by_label("Minimum recall").fill("50")
    page.get_by_role("button", name="Save").click()
    expect(row_of(page, "town/gate").locator("[data-column=holds]")).to_have_text("met")


def test_an_asset_is_renamed(studio: Studio, page: Page) -> None:
    studio.open(page, "changed")
    change(page, "props/new", "Rename")
    field = page.get_by_label("New name")
    field.fill("props/tower")
    page.get_by_role("button", name="Rename").click()
    expect(page.get_by_text("There is an asset 'props/tower' already")).to_be_visible()
    page.get_by_role("button", name="Close").click()
    field.fill(" ")
    page.get_by_role("button", name="Rename").click()
    expect(page.get_by_text("This name cannot be used")).to_be_visible()
    field.fill("props/newer")
    page.get_by_role("button", name="Rename").click()
    expect(row_of(page, "props/newer")).to_be_visible()
    change(page, "props/newer", "Rename")
    field.fill("props/new")
    page.keyboard.press("Enter")
    expect(row_of(page, "props/new")).to_be_visible()


def test_what_is_deleted_comes_back_by_undo_and_later(studio: Studio, page: Page) -> None:
    studio.open(page, "changed")
    change(page, "props/new", "Delete")
    expect(page.get_by_text("Deleted props/new.")).to_be_visible()
    expect(row_of(page, "props/new")).to_be_hidden()
    page.get_by_role("button", name="Undo").click()
    expect(row_of(page, "props/new")).to_be_visible()
    expect(page.get_by_role("button", name="Undo")).to_be_hidden()
    for name in ("props/new", "props/tower"):
        page.get_by_label(f"Choose {name}").check()
    expect(page.get_by_text("2 chosen")).to_be_visible()
    page.get_by_role("group", name="Chosen assets").get_by_role("button", name="Delete").click()
    expect(page.get_by_text("Deleted 2 assets.")).to_be_visible()
    expect(page.get_by_text("2 shown")).to_be_visible()
    page.reload()
    page.get_by_text("Deleted assets (2)").click()
    for name in ("props/new", "props/tower"):
        page.get_by_role("button", name=f"Restore {name}").click()
        expect(row_of(page, name)).to_be_visible()
    expect(page.get_by_text("Deleted assets (")).to_be_hidden()
