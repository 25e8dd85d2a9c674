"""HTML from the templates that stand beside the modules that fill them.

Every word that goes into a template is escaped, wherever it comes from: none is marked as safe.
A name that a template uses and nobody gave is an error, not an empty place.
"""

from __future__ import annotations

import base64
from functools import lru_cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

_PACKAGE = Path(__file__).parent.parent


def page_html(template: str, **values: object) -> str:
    """The page that a template makes of plain values.

    ``template``  its place in the package: ``"report/page.html"``.
    """
    return _environment().get_template(template).render(values)


def png_address(data: bytes) -> str:
    """A picture as the address of itself, so that a page needs no file beside it."""
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")


@lru_cache(maxsize=1)
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(_PACKAGE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
