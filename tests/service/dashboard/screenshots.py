"""Pictures of pages, small enough to be kept."""

from __future__ import annotations

import io
import os
from pathlib import Path

from PIL import Image
from playwright.sync_api import Locator, Page

_FOLDER = os.environ.get("OCCLUDER_SCREENSHOTS")
_LARGEST = 150_000  # bytes


def keep_picture(shown: Page | Locator, name: str, otherwise: Path) -> Image.Image:
    """Write ``name``.png into the folder OCCLUDER_SCREENSHOTS, or else into another one.

    ``OCCLUDER_SCREENSHOTS=docs/images pytest -m 'pages or vital' tests/service/dashboard`` renews
    those of the docs.
    """
    picture = Image.open(io.BytesIO(shown.screenshot(animations="disabled"))).convert("RGB")
    path = Path(_FOLDER) / f"{name}.png" if _FOLDER else otherwise / f"{name}.png"
    few = picture.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    assert path.stat().st_size < _LARGEST, f"{path.name} has {path.stat().st_size:,} bytes"
    return picture
