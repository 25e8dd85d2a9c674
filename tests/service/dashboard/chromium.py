"""A real browser for tests, and a watch over what pages do in it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Error,
    expect,
    sync_playwright,
)

from tests.waiting import BUSY

ARGUMENTS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # Pages are put together without OpenGL, which here is the processor too and takes it twice as
    # long; what WebGL draws is drawn as before.
    "--disable-gpu-compositing",
)
DESKTOP = {"width": 1280, "height": 800}
TABLET = {"width": 820, "height": 1180}

_NAMES = ("chromium", "chromium-browser", "google-chrome")


@contextmanager
def chromium() -> Iterator[Browser]:
    """A browser that draws WebGL without a graphics card; skips where none is installed."""
    path = next(filter(None, map(shutil.which, _NAMES)), None)
    if path is None:
        pytest.skip(f"there is no browser: none of {', '.join(_NAMES)} is on the PATH")
    expect.set_options(timeout=1000.0 * BUSY)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        try:
            yield browser
        finally:
            browser.close()


@dataclass
class Watch:
    """What a page asked for and complained about.

    ``expected``  parts of complaints that a test means to provoke.
    """

    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    expected: list[str] = field(default_factory=list)

    def over(self, context: BrowserContext) -> None:
        context.on("request", lambda request: self.requests.append(request.url))
        context.on("console", self._heard)
        context.on("weberror", lambda error: self._failed(error.error))
        context.on(
            "page",
            lambda page: page.on("websocket", lambda socket: self.requests.append(socket.url)),
        )

    def expect(self, part: str) -> None:
        """Complaints with this part are no fault."""
        self.expected.append(part)

    def check(self) -> None:
        """Fail where a request has left the machine or fetched a font, or a page has complained."""
        away = [url for url in self.requests if not _stays(url)]
        assert not away, f"requests have left the machine: {away}"
        fonts = [url for url in self.requests if urlsplit(url).path.endswith(".woff2")]
        assert not fonts, f"an icon is not in service/dashboard/icons.py: {fonts}"
        faults = [one for one in self.complaints if not any(part in one for part in self.expected)]
        assert not faults, f"the page complains: {faults}"

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.complaints.append(f"{message.text} ({message.location.get('url', '')})")

    def _failed(self, error: Error) -> None:
        self.complaints.append(str(error))


def _stays(url: str) -> bool:
    parts = urlsplit(url)
    return parts.scheme in ("data", "blob", "about") or parts.hostname == "127.0.0.1"
