"""What the address of a page says, and the same page for whoever is sent the link."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import quote_plus

from playwright.sync_api import Browser, Page, expect


def expect_kept(page: Page, /, **values: str | None) -> None:
    """Wait until the address names these values; None stands for nothing under the name."""
    for name, value in values.items():
        if value is None:
            expect(page).not_to_have_url(re.compile(rf"[?&]{name}="))
        else:
            expect(page).to_have_url(
                re.compile(rf"[?&]{name}={re.escape(quote_plus(value, safe='*'))}(&|$)")
            )


@contextmanager
def elsewhere(browser: Browser, page: Page) -> Iterator[Page]:
    """The page's address, opened in a browser that knows nothing but it."""
    context = browser.new_context(viewport=page.viewport_size)
    try:
        other = context.new_page()
        other.goto(page.url)
        yield other
    finally:
        context.close()
