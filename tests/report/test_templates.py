"""Templates escape all that is put into them, and miss nothing in silence."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import pytest
from jinja2 import UndefinedError

import simplifier
from simplifier.report.templates import page_html, png_address

PACKAGE = Path(simplifier.__file__).parent
TEMPLATES = sorted(path.relative_to(PACKAGE).as_posix() for path in PACKAGE.glob("*/*.html"))


def test_all_pages_and_what_they_share_are_found():
    assert TEMPLATES == [
        "culling/walk_page.html", "report/base.html", "report/page.html", "report/parts.html",
        "tradeoff/page.html",
    ]  # fmt: skip


@pytest.mark.parametrize("template", TEMPLATES)
def test_no_template_takes_anything_as_safe(template):
    text = (PACKAGE / template).read_text("utf-8")
    assert not re.search(r"\bsafe\b|autoescape|\{% *(?:raw|filter)\b", text)


@pytest.mark.parametrize("template", ["report/page.html", "tradeoff/page.html"])
def test_a_value_that_is_missing_is_an_error(template):
    with pytest.raises(UndefinedError):
        page_html(template, name="x")


def test_pictures_are_addresses_of_themselves():
    kind, _, data = png_address(b"\x89PNG\0\xff").partition(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data) == b"\x89PNG\0\xff"
