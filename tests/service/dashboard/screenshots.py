"""Pictures of pages, small enough to be kept."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page

_FOLDER = os.environ.get("OCCLUDER_SCREENSHOTS")
_LARGEST = 150_000  # bytes
_KEPT = 128  # colours of 256 that stay as they are: those of most pixels


def keep_picture(shown: Page | Locator, name: str, otherwise: Path) -> Image.Image:
    """Write ``name``.png into the folder OCCLUDER_SCREENSHOTS, or else into another one.

    ``OCCLUDER_SCREENSHOTS=docs/images pytest -m 'pages or vital' tests/service/dashboard`` renews
    those of the docs.
    """
    picture = Image.open(io.BytesIO(shown.screenshot(animations="disabled"))).convert("RGB")
    path = Path(_FOLDER) / f"{name}.png" if _FOLDER else otherwise / f"{name}.png"
    _in_few_colours(picture).save(path, optimize=True)
    assert path.stat().st_size < _LARGEST, f"{path.name} has {path.stat().st_size:,} bytes"
    return picture


def _in_few_colours(picture: Image.Image) -> Image.Image:
    """256 at most: the commonest as they are, such as those of surfaces, and clusters of others.

    Pillow's own search of a palette is coarse: it makes white a grey.
    """
    red, green, blue = np.moveaxis(np.asarray(picture, dtype=np.int32), -1, 0)
    packed = (red << 16 | green << 8 | blue).ravel()
    found, which, counts = np.unique(packed, return_inverse=True, return_counts=True)
    colours = np.stack([found >> 16, found >> 8 & 255, found & 255], axis=-1)
    commonest = colours[np.argsort(-counts, kind="stable")[:_KEPT]]
    clusters = picture.quantize(256 - _KEPT, Image.Quantize.MAXCOVERAGE).getpalette() or []
    palette = np.concatenate([commonest, np.reshape(clusters, (-1, 3))])
    nearest = [((palette - colour) ** 2).sum(axis=1).argmin() for colour in colours]
    few = Image.fromarray(
        np.array(nearest, dtype=np.uint8)[which].reshape(picture.height, picture.width)
    )
    few.putpalette(palette.astype(np.uint8).tobytes())
    return few
