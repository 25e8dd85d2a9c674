"""Flythrough -> one HTML page that plays it: nothing is fetched, and nothing leaves the machine."""

from __future__ import annotations

import base64
import re
from functools import lru_cache
from pathlib import Path

from simplifier.culling.flythrough import Flythrough
from simplifier.culling.flythrough_rows import pixel_words, recall_words
from simplifier.culling.walk_file import encode_walk
from simplifier.report.templates import page_html
from simplifier.version import VERSION
from simplifier.wording import count

_PLAYER = Path(__file__).parent / "player"
_MODULES = ("walk_file.js", "picture.js", "player.js", "stand_alone.js")
"""Each after those that it imports."""

_IMPORT = re.compile(r"^import .*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(async )?(class|const|function)\b)", re.MULTILINE)


def walk_page(flown: Flythrough, scene_name: str) -> str:
    """The page as HTML text."""
    total = flown.total
    parts = count(len(flown.parts.object_of), "part")
    summary = (
        f"{count(len(flown.scene), 'object')} in {parts}, path '{flown.path.name}'. "
        f"Objects: {recall_words(total.objects)}. Wrong pixels: {pixel_words(total)}."
    )
    return page_html(
        "culling/walk_page.html",
        name=scene_name,
        summary=summary,
        colophon=f"planar-occluder {VERSION}",
        walk=base64.b64encode(encode_walk(flown, scene_name)).decode("ascii"),
        script="data:text/javascript;base64," + _script(),
    )


@lru_cache(maxsize=1)
def _script() -> str:
    """The player as one module, base64; a module in a data address can import no other."""
    texts = [(_PLAYER / name).read_text("utf-8") for name in _MODULES]
    whole = "\n".join(_EXPORT.sub("", _IMPORT.sub("", text)) for text in texts)
    return base64.b64encode(whole.encode()).decode("ascii")
