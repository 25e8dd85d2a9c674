"""What tests of pages share: a browser, and pages that are watched."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from tests.service.dashboard.chromium import DESKTOP, Watch, chromium


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
