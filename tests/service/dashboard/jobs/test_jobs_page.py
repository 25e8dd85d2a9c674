"""The page of all jobs, over a folder that a server has left and one who works on it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from service.jobs.job import Failure
from tests.service.dashboard.addresses import elsewhere, expect_kept
from tests.service.dashboard.chromium import TABLET
from tests.service.dashboard.legibility import covered_texts, faint_texts, overflows
from tests.service.dashboard.meshes import castle_file
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.screenshots import keep_picture
from tests.service.dashboard.serving import IDLE, served
from tests.service.dashboard.stock import stocked
from tests.waiting import BUSY

MANY = 60


@dataclass(frozen=True)
class Past:
    """A service whose jobs have ended: its address, and one of them that failed."""

    address: str
    failed: str


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory, castle: JobResult) -> Iterator[Past]:
    folder = tmp_path_factory.mktemp("data")
    died = Failure("process-died", "the process ended by signal 9", "submit it again")
    with stocked(folder) as stock:
        for _ in range(MANY):
            stock.failure(castle, died)
        failed = stock.failure(castle, died)
        stock.run(castle, asset="props/castle")
    environment = {
        "OCCLUDER_DATA": str(folder), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0",
        **IDLE,
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        yield Past(address, failed.id)


@pytest.mark.vital
def test_what_failed_says_why_and_what_to_do(page: Page, past: Past, tmp_path: Path) -> None:
    page.goto(f"{past.address}/jobs")
    fault = page.get_by_role("note").first
    expect(fault).to_contain_text("The worker process ended at every attempt")
    expect(fault).to_contain_text("The process ended by signal 9.")
    expect(fault).to_contain_text("What to do: Submit it again.")
    keep_picture(page, "dashboard_jobs", tmp_path)


def test_what_runs_and_waits_is_shown_and_can_be_ended(
    page: Page, working: str, tmp_path: Path
) -> None:
    mesh = castle_file(tmp_path).read_bytes()
    for name in ("first.obj", "second.obj"):
        query = {"filename": name, "preset": "draft", "lods": 1, "time_limit": 600}
        assert httpx.post(
            f"{working}/v1/occluders", params=query, content=mesh, timeout=BUSY
        ).is_success
    page.goto(f"{working}/jobs")
    running = page.get_by_role("table", name="Jobs that run").get_by_role("row")
    expect(running.filter(has_text="first.obj")).to_contain_text("refining", timeout=60_000.0)
    waiting = page.get_by_role("table", name="Jobs that wait").get_by_role("row")
    second = waiting.filter(has_text="second.obj")
    expect(second.get_by_role("cell", name="1", exact=True)).to_be_visible()
    for name in ("second.obj", "first.obj"):
        page.get_by_role("button", name=f"Cancel {name}").click()
    expect(page.get_by_text("No jobs are waiting.")).to_be_visible()
    expect(page.get_by_text("No jobs are running.")).to_be_visible()


def test_jobs_are_filtered_by_state_and_paged(page: Page, past: Past) -> None:
    page.goto(f"{past.address}/jobs")
    retries = page.get_by_role("button", name="Retry")
    expect(retries).to_have_count(49)  # a page, less the one that succeeded
    page.get_by_role("button", name="Older").click()
    expect(retries).to_have_count(MANY + 1 - 49)
    page.get_by_role("button", name="Newer").click()
    expect(retries).to_have_count(49)
    page.get_by_label("Show").click()
    page.get_by_role("option", name="succeeded").click()
    expect(retries).to_have_count(0)
    expect(page.get_by_role("link", name="props/castle")).to_have_count(1)


def test_an_address_may_name_the_state(page: Page, past: Past) -> None:
    page.goto(f"{past.address}/jobs?state=cancelled")
    expect(page.get_by_text("No jobs match this filter.")).to_be_visible()
    page.goto(f"{past.address}/jobs?state=<script>&before=-1")
    expect(page.get_by_role("link", name="props/castle")).to_be_visible()
    page.goto(f"{past.address}/jobs?before={'9' * 40}")
    expect(page.get_by_role("link", name="props/castle")).to_be_visible()


def test_a_link_shows_the_same_jobs(browser: Browser, page: Page, past: Past) -> None:
    page.goto(f"{past.address}/jobs")
    page.get_by_label("Show").click()
    page.get_by_role("option", name="failed").click()
    expect_kept(page, state="failed")
    page.get_by_role("button", name="Older").click()
    expect(page).to_have_url(re.compile("before=[0-9]"))
    rows = page.get_by_role("table", name="Jobs that have ended").get_by_role("link")
    expect(page.get_by_role("button", name="Older")).to_be_hidden()
    shown = [row.get_attribute("href") for row in rows.all()]
    with elsewhere(browser, page) as other:
        rows = other.get_by_role("table", name="Jobs that have ended").get_by_role("link")
        expect(rows).to_have_count(len(shown))
        assert [row.get_attribute("href") for row in rows.all()] == shown
        other.get_by_role("button", name="Newer").click()
        expect(other.get_by_role("button", name="Older")).to_be_visible()
        expect_kept(other, state="failed", before=None)
    page.get_by_label("Show").click()
    page.get_by_role("option", name="all that ended").click()
    expect_kept(page, state=None, before=None)


def test_a_failed_job_is_tried_again_and_watched(page: Page, past: Past) -> None:
    page.goto(f"{past.address}/jobs/{past.failed}")
    page.get_by_role("button", name="Retry").click()
    expect(page.get_by_role("link", name="Retry of an earlier job")).to_be_visible()
    page.goto(f"{past.address}/jobs")
    expect(page.get_by_text("No jobs are waiting.")).to_be_visible(timeout=30_000.0)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_can_be_read_on_a_tablet(browser: Browser, past: Past, scheme: str) -> None:
    context = browser.new_context(viewport=TABLET, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    for place in ("/jobs", f"/jobs/{past.failed}"):
        page.goto(f"{past.address}{place}")
        expect(page.get_by_role("note").first).to_be_visible()
        assert faint_texts(page) == []
        assert covered_texts(page) == []
        assert not overflows(page)
    context.close()
