"""The site as it is built: strictly, with links that lead somewhere, and nothing from elsewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from playwright.sync_api import expect

from tests.acceptance.command import ROOT, environment
from tests.service.dashboard.chromium import chromium

pytestmark = pytest.mark.slow

_LOADED = re.compile(r"<(?:script|img|iframe|link)\b[^>]*?\b(?:src|href)=\"?([^\"\s>]+)")
_LINK = re.compile(r"<a\b[^>]*?\bhref=\"?([^\"\s>]+)")
_ANCHOR = re.compile(r"\b(?:id|name)=\"?([^\"\s>]+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT, env=environment(NO_MKDOCS_2_WARNING="1"), capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site):
    return {one: one.read_text(encoding="utf-8") for one in sorted(site.rglob("*.html"))}


def test_nothing_is_fetched_from_elsewhere(pages):
    assert len(pages) > 100
    for page, text in pages.items():
        for one in _LOADED.findall(text):
            assert not urlsplit(one).scheme.startswith("http"), f"{page.name}: {one}"
            assert not one.startswith("//"), f"{page.name}: {one}"


def test_every_link_leads_to_a_page_and_a_section_of_it(site, pages):
    anchors = {page: set(_ANCHOR.findall(text)) for page, text in pages.items()}
    lost = []
    for page, text in pages.items():
        if page.name == "404.html":  # which is for servers, and has links from their root
            continue
        for one in map(unescape, _LINK.findall(text)):
            parts = urlsplit(one)
            if parts.scheme or parts.netloc:
                continue
            there = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            section = unquote(parts.fragment)
            if not there.exists() or (section and section not in anchors.get(there, ())):
                lost.append(f"{page.relative_to(site)}: {one}")
    assert not lost, "\n".join(lost)


def test_it_works_from_a_folder(site):
    """Pages, sections and the search, in a browser that may fetch nothing else."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 390, "height": 844})
        fetched, complaints = [], []
        page.on("request", lambda one: fetched.append(one.url))
        page.on("pageerror", lambda one: complaints.append(str(one)))
        for name in ("index.html", "tutorial.html", "reference/commands/simplify.html"):
            page.goto((site / name).as_uri())
            width = page.evaluate("document.documentElement.scrollWidth")
            assert width <= 390, f"{name} is {width} pixels wide"
        page.set_viewport_size({"width": 1440, "height": 900})
        page.goto((site / "index.html").as_uri())
        page.locator("[data-md-component=search-query]").click()
        page.keyboard.type("overhang")
        found = page.locator(".md-search-result__meta")
        expect(found).to_have_text(re.compile(r"\d+ matching documents"))
        page.locator(".md-search-result__link").first.click()
        page.wait_for_url(re.compile(r"^file:.*\?h=overhang"))
        assert not complaints
        assert fetched
        assert all(urlsplit(one).scheme in ("file", "data", "blob", "about") for one in fetched)


def test_what_is_generated_is_not_kept(site):
    assert (site / "reference" / "commands" / "simplify.html").is_file()
    assert not Path(ROOT / "docs" / "reference").exists()
