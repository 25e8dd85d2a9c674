"""The pages of assets and jobs in a real browser, over real results."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from service.dashboard.colours import STOPS
from service.jobs.asset import Thresholds
from service.jobs.job import Failure, JobKind
from service.keep import Keep
from simplifier import OCCLUDER_SUFFIXES
from tests.service.dashboard.addresses import expect_kept
from tests.service.dashboard.chromium import TABLET, Watch
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows
from tests.service.dashboard.results import JobResult, castle_result
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import TENANT, stocked
from tests.service.dashboard.viewer_pages import kinds, pixels, settle, shown, yellow

HOSTILE = "</title><script>window.hit = 1</script><img src=x onerror='hit = 1'>{{ hit }} \u202e" + (
    "x" * 200
)
_VIEWER = "castle.ply, original and occluder"


@dataclass(frozen=True)
class Filled:
    """A service with some jobs: its address, and theirs."""

    address: str
    asset: str
    hostile: str
    empty: str
    first: str
    second: str
    failed: str
    lean: str
    below: str
    judged: str
    ours: str
    elsewhere: str


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory, castle: JobResult) -> Iterator[Filled]:
    folder = tmp_path_factory.mktemp("data")
    finer = castle_result(tmp_path_factory.mktemp("finer"), budget=128, resolution=48)
    with stocked(folder) as stock:
        first, second = (stock.run(one, asset="props/castle") for one in (castle, finer))
        stock.run(
            castle, asset=HOSTILE, warnings=("<b>a hole</b> at {{ 1 + 1 }}",), verdict="unusable",
            reason="it hides <i>nothing</i>", try_next="run <b>this</b> {{ 1 + 1 }}",
        )  # fmt: skip
        ours = stock.run(castle, asset="props/judged")
        elsewhere = stock.run(
            replace(castle, kind=JobKind.EVALUATION, options={"views": 64, "up": "y"}),
            asset="props/judged",
        )
        failed = stock.failure(
            castle,
            Failure("out-of-memory", "the job used more than 64 MiB", "lower the resolution"),
        )
        lean = stock.run(castle_result(tmp_path_factory.mktemp("lean"), Keep.LEAN))
        assets = (
            stock.demand("props/castle", Thresholds(min_recall=0.5)),
            stock.demand(HOSTILE, Thresholds()),
            stock.demand("props/new", Thresholds()),
        )
        judged = stock.demand("props/judged", Thresholds())
        below = stock.demand("town/gate", Thresholds())
        stock.assets.set_folder_thresholds(TENANT, "town", Thresholds(min_recall=0.7))
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0",
        **IDLE,
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        yield Filled(
            address, *assets, first.id, second.id, failed.id, lean.id, below, judged, ours.id,
            elsewhere.id,
        )  # fmt: skip


@pytest.mark.vital
def test_the_worst_view_opens(
    page: Page, filled: Filled, castle: JobResult, tmp_path: Path
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    host = shown(page, _VIEWER)
    assert yellow(pixels(host)) > 0.01
    worst = castle.report["worst_view"]
    page.get_by_role("table", name="Views of the worst recall").get_by_role("button").first.click()
    told = page.get_by_text(re.compile(f"View {worst['index']}, from .*: recall .*finest"))
    expect(told).to_be_visible()
    expect_kept(page, view=str(worst["index"]), mode="silhouette")
    page.reload()  # what was chosen stands in the address
    host = shown(page, _VIEWER)
    expect(told).to_be_visible()
    expect(page.get_by_text("original and occluder ")).to_contain_text("%")
    settle(host)
    assert set(range(4)) == set(kinds(pixels(host))[2:-2, 2:-2].ravel().tolist())
    page.set_viewport_size({"width": 1280, "height": 1000})
    settle(host)
    page.evaluate("scrollTo(0, 0)")
    keep_picture(page, "dashboard_asset", tmp_path)


def test_the_heat_map_comes_when_it_is_asked_for(
    page: Page, filled: Filled, watch: Watch, tmp_path: Path
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    host = shown(page, _VIEWER)
    assert not any(url.endswith("loss.json") for url in watch.requests)
    page.get_by_role("button", name="Heat map").click()
    expect(page.get_by_text("Over the whole mesh: ")).to_be_visible(timeout=60_000)
    expect(page.get_by_text("100 %, never covered")).to_be_visible()
    settle(host)
    bright, dark = (np.abs(pixels(host) - one).max(axis=-1) < 30 for one in (STOPS[-1], STOPS[1]))
    assert bright.mean() > 10 * dark.mean() > 0.0  # the spires alone are never covered
    keep_picture(page.locator(".mesh-viewer").first, "dashboard_heat_map", tmp_path)


def test_from_an_asset_one_goes_on_to_its_tradeoff_and_to_another_run(
    page: Page, filled: Filled
) -> None:
    place = f"{filled.address}/assets/{filled.asset}"
    page.goto(place)
    page.get_by_role("link", name="Speed against accuracy").click()
    page.wait_for_url(f"**/tradeoff/{filled.asset}")
    expect(page.get_by_role("heading", name="props/castle")).to_be_visible()
    for run, wanted in (("", filled.second), (f"?run={filled.first}", filled.first)):
        page.goto(f"{place}{run}")
        again = page.get_by_role("link", name="Run again with other settings")
        expect(again).to_have_attribute("href", f"/submit?from={wanted}")
    again.click()
    expect(page.get_by_role("button", name="Run again")).to_be_visible()


def test_the_keyboard_opens_a_view_on_the_map(
    page: Page, filled: Filled, castle: JobResult
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    shown(page, _VIEWER)
    page.get_by_role("listbox", name="Views by recall").focus()
    page.keyboard.press("Home")
    page.keyboard.press("Enter")
    index = castle.report["worst_view"]["index"]
    expect(page.get_by_text(re.compile(f"View {index}, from .*: recall .*finest"))).to_be_visible()


def test_the_verdict_is_told_with_its_reason_and_what_to_try(
    page: Page, filled: Filled, castle: JobResult
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    told = castle.report["verdict"]
    verdict = page.locator(".engine-verdict")
    expect(verdict).to_contain_text(f"{told['word'].capitalize()} for an engine")
    expect(verdict).to_contain_text(told["reason"][1:])
    expect(page.locator(".numbers")).to_contain_text("Overhang")
    levels = page.get_by_role("table", name="Levels of detail")
    expect(levels.get_by_role("row").nth(1)).to_contain_text(told["word"])
    expect(page.locator(".history").get_by_text(told["word"], exact=True).first).to_be_visible()
    page.goto(f"{filled.address}/assets/{filled.hostile}")
    expect(page.locator(".engine-verdict .command")).to_have_text("run <b>this</b> {{ 1 + 1 }}")
    expect(page.locator(".engine-verdict.bad")).to_have_count(1)


def test_thresholds_turn_an_asset_red(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}")
    expect(page.locator(".numbers .good")).to_have_text("met")
    page.get_by_role("button", name="Thresholds").click()
    page.get_by_label("Minimum precision").fill("99.99")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".numbers .bad")).to_have_text("missed")
    expect(page.locator(".history .bad")).to_have_count(2)


def test_the_dialog_shows_the_limits_of_the_folder(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.below}")
    page.get_by_role("button", name="Thresholds").click()
    expect(page.get_by_label("Minimum recall")).to_have_attribute("placeholder", "70")
    expect(page.get_by_label("Minimum precision")).to_have_attribute("placeholder", "no limit")


def test_two_runs_are_chosen_and_compared(page: Page, filled: Filled, tmp_path: Path) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}")
    compare = page.get_by_role("button", name="Compare the two")
    expect(compare).to_be_disabled()
    boxes = page.locator(".history tbody").get_by_role("checkbox")
    for box in (0, 1):
        boxes.nth(box).click()
    compare.click()
    page.wait_for_url(f"**/compare?a={filled.first}&b={filled.second}")
    options = page.get_by_role("table", name="Options and files that differ")
    expect(options.get_by_role("row", name="resolution")).to_contain_text("3248")
    page.locator(".mesh-viewer[data-state=ready]").nth(1).wait_for(timeout=20_000)
    page.get_by_role("table", name="Recall of views").get_by_role("button").first.click()
    expect(page.get_by_text("on the finest level")).to_have_count(2)
    page.evaluate("scrollTo(0, 0)")
    for host in page.get_by_role("application").all():
        settle(host)
        assert {1, 2, 3} <= set(kinds(pixels(host)).ravel().tolist())
    keep_picture(page, "dashboard_compare", tmp_path)


def test_figures_read_alike_wherever_they_stand(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}")
    numbers = dict(one.inner_text().splitlines() for one in page.locator(".numbers > div").all())
    assert re.fullmatch(r"\d+\.\d\d %", numbers["Recall"])
    expect(page.get_by_text(re.compile(r"^Recall: half of"))).to_contain_text(
        f"the worst {numbers['Worst view']}."
    )
    run = page.locator(".history tbody tr").first
    for name in ("Recall", "Worst view", "Run time"):
        expect(run.get_by_text(numbers[name], exact=True)).to_be_visible()
    expect(page.locator(".history").get_by_text("Run time", exact=True)).to_be_visible()
    expect(page.get_by_text(re.compile(r"^Thresholds: recall at least 50 %"))).to_be_visible()


def test_an_evaluation_is_told_from_a_run_of_ours(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.judged}")
    note = page.get_by_text("This run is an evaluation.")
    expect(note).to_be_visible()
    runs = page.locator(".history tbody tr")
    for place, kind in enumerate(("evaluation", "occluder")):
        expect(runs.nth(place).get_by_text(kind, exact=True)).to_be_visible()
    assert not overflows(page)
    page.goto(f"{filled.address}/assets/{filled.judged}?run={filled.ours}")
    expect(page.locator(".engine-verdict")).to_be_visible()
    expect(note).to_have_count(0)
    page.goto(f"{filled.address}/compare?a={filled.ours}&b={filled.elsewhere}")
    for job, kind in ((filled.ours, "occluder"), (filled.elsewhere, "evaluation")):
        told = re.compile(f"^[AB]: .* UTC, {kind}, job {job[:8]}$")
        expect(page.get_by_role("heading", name=told)).to_be_visible()


def test_a_run_that_has_kept_little_says_so_and_is_seen_all_the_same(
    page: Page, filled: Filled, tmp_path: Path
) -> None:
    page.goto(f"{filled.address}/jobs/{filled.lean}")
    expect(page.get_by_text("This job has kept its occluder and its report.")).to_be_visible()
    files = page.get_by_role("table", name="Files of the job")
    row = files.get_by_role("row").filter(
        has=page.get_by_role("link", name="lod1.tres", exact=True)
    )
    expect(row).to_contain_text("made when opened")
    # Original and levels come when the viewer asks for them.
    assert yellow(pixels(shown(page, _VIEWER))) > 0.01
    with page.expect_download() as coming:
        page.get_by_role("link", name="Level 1 as .obj").click()
    assert "\nf " in coming.value.path().read_text()
    page.reload()
    row = files.get_by_role("row").filter(has=page.get_by_role("link", name="lod1.obj", exact=True))
    expect(row).not_to_contain_text("made when opened")
    keep_picture(page, "dashboard_lean", tmp_path)
    page.get_by_role("button", name="Download", exact=True).click()
    with page.expect_download() as coming:
        page.get_by_text("Everything, as a zip").click()
    assert coming.value.suggested_filename == "castle_occluder.zip"
    with zipfile.ZipFile(coming.value.path()) as archive:
        names = {name.removeprefix("castle/") for name in archive.namelist()}
        assert archive.testzip() is None
    written = {f"lod{level}{suffix}" for level in (0, 1) for suffix in OCCLUDER_SUFFIXES}
    assert {*written, "occluder.glb", "occluder.occ", "report.json", "report.html"} < names
    assert not {"levels.npz", "original.glb", "loss.json"} & names


def test_downloads_are_what_the_job_has_made(page: Page, filled: Filled, castle: JobResult) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    with page.expect_download() as download:
        page.get_by_role("link", name="Level 1 as .obj").click()
    assert download.value.suggested_filename == "lod1.obj"
    assert download.value.path().read_bytes() == (castle.folder / "lod1.obj").read_bytes()


def test_an_asset_begins_with_its_verdict_and_has_one_button_to_download(
    page: Page, filled: Filled, castle: JobResult
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}?run={filled.first}")
    headings = page.get_by_role("heading", level=2).all_inner_texts()
    assert headings[0].endswith("for an engine")
    page.get_by_role("button", name="Download", exact=True).first.click()
    with page.expect_download() as download:
        page.locator(".q-menu a").filter(has_text="Level 1, ").filter(has_text=", obj").click()
    assert download.value.path().read_bytes() == (castle.folder / "lod1.obj").read_bytes()
    # What is seldom wanted is folded away.
    stages = page.get_by_role("table", name="Seconds by stage")
    expect(stages).to_be_hidden()
    page.get_by_text("Time by stage", exact=True).click()
    expect(stages).to_be_visible()


def test_the_history_is_a_chart_and_views_are_named_as_people_say_them(
    page: Page, filled: Filled, watch: Watch
) -> None:
    page.goto(f"{filled.address}/assets/{filled.asset}")
    worst = page.get_by_role("table", name="Views of the worst recall")
    expect(worst.get_by_role("row").nth(1)).to_contain_text(re.compile("from (the|straight) "))
    # The library comes with the first chart in sight.
    assert not any("nicegui-echart" in url for url in watch.requests)
    chart = page.get_by_role("img", name="Recall and precision of 2 runs over time")
    chart.scroll_into_view_if_needed()
    expect(chart.locator("svg")).to_be_visible()
    expect(chart.get_by_text("least recall")).to_be_visible()


def test_a_failed_job_explains_itself(page: Page, filled: Filled, tmp_path: Path) -> None:
    page.goto(f"{filled.address}/jobs/{filled.failed}")
    expect(page.get_by_text("The job used more than 64 MiB.")).to_be_visible()
    expect(page.get_by_text("What to do: Lower the resolution.")).to_be_visible()
    keep_picture(page, "dashboard_failed_job", tmp_path)


def test_a_job_leads_to_its_asset(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/jobs/{filled.first}")
    page.get_by_role("link", name="props/castle").click()
    page.wait_for_url(f"**/assets/{filled.asset}")


def test_names_and_warnings_are_but_text(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.hostile}")
    expect(page.get_by_role("heading", level=1)).to_have_text(HOSTILE)
    expect(page.get_by_text("<b>a hole</b> at {{ 1 + 1 }}")).to_be_visible()
    shown(page, _VIEWER)
    assert page.title() == f"{HOSTILE} - planar-occluder"
    assert page.evaluate("window.hit === undefined")
    assert not overflows(page)


def test_an_asset_without_a_run_says_so(page: Page, filled: Filled) -> None:
    page.goto(f"{filled.address}/assets/{filled.empty}")
    expect(page.get_by_text("No run of this asset has succeeded yet.")).to_be_visible()


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ("assets/none", "There is no asset 'none'."),
        ("jobs/none", "There is no job 'none'."),
        ("compare?a=none&b=none", "There is no job 'none'."),
        ("submit?from=none", "There is no job 'none'."),
    ],
)
def test_what_is_not_there_is_said_not_to_be(
    page: Page, filled: Filled, watch: Watch, place: str, told: str
) -> None:
    watch.expect("status of 404")  # which the browser says of the page itself
    answer = page.goto(f"{filled.address}/{place}")
    assert answer is not None
    assert answer.status == 404
    expect(page.get_by_role("heading", name="Not found")).to_be_visible()
    expect(page.get_by_text(told, exact=True)).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_can_be_read_on_a_tablet(
    browser: Browser, filled: Filled, scheme: str, tmp_path: Path
) -> None:
    context = browser.new_context(viewport=TABLET, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(f"{filled.address}/assets/{filled.asset}")
    shown(page, _VIEWER)
    assert faint_texts(page) == []
    assert covered_texts(page) == []
    assert not overflows(page)
    keep_picture(page, f"dashboard_tablet_{scheme}", tmp_path)
    context.close()
