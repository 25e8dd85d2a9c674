"""What the navigation of the site names, and that it names everything."""

from __future__ import annotations

import yaml

from tests.acceptance.command import ROOT
from tests.test_documentation import sections
from website import commands, http_routes, json_keys, python_names
from website.navigation import expanded, targets
from website.repository import BELOW

NAV = yaml.unsafe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
WRITTEN = {one.relative_to(ROOT / "docs").as_posix() for one in (ROOT / "docs").rglob("*.md")}
MADE = [
    *commands.pages(), *http_routes.pages(), *json_keys.pages(), *python_names.pages(),
]  # fmt: skip


def source(place):
    """The file of the repository behind a page of the site that is not made for it."""
    if place == "index.md":
        return ROOT / "README.md"
    if place.startswith(f"{BELOW}/"):
        return ROOT / place.removeprefix(f"{BELOW}/")
    return ROOT / "docs" / place


def test_it_names_every_page_once():
    named = [one for one in targets(expanded(NAV, [*MADE, *sorted(WRITTEN)])) if one[0] != "/"]
    assert len(named) == len(set(named))
    assert set(named) >= WRITTEN | set(MADE)


def test_every_page_and_section_that_it_names_is_there():
    for one in targets(expanded(NAV, [*MADE, *sorted(WRITTEN)])):
        if one not in MADE and not one.startswith("/"):
            assert source(one).is_file(), one
    for one in targets(NAV):
        page, mark, section = one.partition("#")
        if mark:
            assert section in sections(source(page)), one


def test_shorthands():
    nav = [{"A": "a.md"}, {"B": ["b/", {"C": "a.md#there"}]}]
    assert expanded(nav, ["b/2.md", "b/1.md", "c.md"]) == [
        {"A": "a.md"}, {"B": [["b/2.md", "b/1.md"], {"C": "/a.html#there"}]},
    ]  # fmt: skip
    assert list(targets(nav)) == ["a.md", "b/", "a.md#there"]
