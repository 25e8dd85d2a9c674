"""What tests look for on a page with a 3D view."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Locator, Page

from service.dashboard.colours import BOTH, MISSED, NEITHER, WRONG

Pixels = NDArray[np.int64]
"""(rows, columns, 3), 0 to 255."""

_UNTIL_STILL = """(host) => new Promise((done) => {
    let last = null, still = 0;
    const look = () => {
        still = host.dataset.frames === last ? still + 1 : 0;
        last = host.dataset.frames;
        if (still < 5) requestAnimationFrame(look); else done();
    };
    look();
})"""


def shown(page: Page, label: str = "castle") -> Locator:
    """The canvas of a viewer that has loaded everything and stands still."""
    page.locator(".mesh-viewer[data-state=ready]").first.wait_for(timeout=20_000)
    host = page.get_by_role("application", name=label, exact=True)
    settle(host)
    return host


def settle(host: Locator) -> None:
    """Wait until nothing is drawn any more."""
    host.evaluate(_UNTIL_STILL)


def frames(host: Locator) -> int:
    """Pictures drawn so far."""
    return int(host.get_attribute("data-frames") or 0)


def pixels(host: Locator) -> Pixels:
    picture = Image.open(io.BytesIO(host.screenshot(animations="disabled"))).convert("RGB")
    return np.asarray(picture, dtype=np.int64)


def kinds(picture: Pixels) -> NDArray[np.int64]:
    """(rows, columns): 0 neither, 1 occluder only, 2 original only, 3 both; nearest colours."""
    palette = np.array([NEITHER, WRONG, MISSED, BOTH])
    return np.asarray(((picture[:, :, None] - palette) ** 2).sum(axis=-1).argmin(axis=-1))


def yellow(picture: Pixels) -> float:
    """Share of the pixels that show an occluder."""
    red, _, blue = np.moveaxis(picture, -1, 0)
    return float((red - blue > 60).mean())


def grey(picture: Pixels) -> float:
    """Share of the pixels that show an original, on the light background."""
    low, high = picture.min(axis=-1), picture.max(axis=-1)
    return float(((high - low < 40) & (high < 225)).mean())
