"""What tests of pages share: a browser, and pages that are watched."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from tests.service.dashboard.chromium import DESKTOP, Watch, chromium
from tests.service.dashboard.parts import FOLDER
from tests.service.dashboard.results import JobResult, castle_result
from tests.service.dashboard.serving import served


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "vital: a test of a page that always runs")


def pytest_itemcollected(item: pytest.Item) -> None:
    """A browser takes seconds a test: all but the vital ones are left to `make test-pages`."""
    if "browser" in getattr(item, "fixturenames", ()) and not item.get_closest_marker("vital"):
        item.add_marker("pages")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One a file: while it is open, no other test of its process can run an event loop."""
    with chromium() as opened:
        yield opened


@pytest.fixture
def watch() -> Watch:
    """Over the test's page; a complaint that is provoked has to be expected."""
    return Watch()


@pytest.fixture
def page(browser: Browser, watch: Watch) -> Iterator[Page]:
    """A page without a past.  The test fails when a request leaves the machine, or when the page
    has an error."""
    context = browser.new_context(viewport=DESKTOP)
    watch.over(context)
    try:
        yield context.new_page()
    finally:
        context.close()
    watch.check()


@pytest.fixture(scope="session")
def castle(tmp_path_factory: pytest.TempPathFactory) -> JobResult:
    """The castle and two levels of its occluder, judged."""
    return castle_result(tmp_path_factory.mktemp("castle"))


@pytest.fixture(scope="session")
def parts_folder(castle: JobResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the castle's job has made, and what tests add."""
    return shutil.copytree(castle.folder, tmp_path_factory.mktemp("parts") / "files")


@pytest.fixture(scope="session")
def parts(parts_folder: Path) -> Iterator[str]:
    """The address of pages that show one component each, with the files of that folder."""
    with served("tests.service.dashboard.parts:make_app()", {FOLDER: str(parts_folder)}) as url:
        yield url


@pytest.fixture(scope="session")
def working(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service with its pages and one worker, who takes seconds to get ready."""
    environment = {
        "OCCLUDER_DATA": str(tmp_path_factory.mktemp("working")), "OCCLUDER_WORKERS": "1",
        "OCCLUDER_MIN_FREE": "0", "OCCLUDER_MAX_UPLOAD": "1000000",
    }  # fmt: skip
    with served("tests.service.dashboard.application:make_app()", environment) as address:
        yield address
