"""Links of pages, as a code host follows them and as the site does."""

from __future__ import annotations

import pytest

from tests.acceptance.command import ROOT
from website import repository
from website.repository import brought_along, linked, rewritten, site_path, source_of


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("README.md", "index.md"),
        ("docs/service.md", "service.md"),
        ("docs/images/castle.png", "images/castle.png"),
        ("docs/decisions", "repository/docs/decisions/index.md"),
        ("CHANGELOG.md", "repository/CHANGELOG.md"),
        ("openapi.yaml", "repository/openapi.yaml.md"),
        ("bench/results/scenes_growth.png", "repository/bench/results/scenes_growth.png"),
        ("examples/ci", "repository/examples/ci/index.md"),
    ],
)
def test_where_files_are_in_the_site(path, place):
    assert site_path(path) == place


@pytest.mark.parametrize(
    ("page", "link", "moved"),
    [
        ("docs/service.md", "[a](build.md#in-ci)", "[a](build.md#in-ci)"),
        ("docs/service.md", "[a](../openapi.yaml)", "[a](repository/openapi.yaml.md)"),
        ("docs/service.md", "[a](../README.md#scenes)", "[a](index.md#scenes)"),
        ("docs/decisions/0010-worker-processes.md", "[a](../../CHANGELOG.md)",
         "[a](../repository/CHANGELOG.md)"),
        ("README.md", "![a](docs/images/castle.png)", "![a](images/castle.png)"),
        ("CHANGELOG.md", "[a](docs/service.md)", "[a](../service.md)"),
        ("README.md", '<img src="docs/images/castle.png">', '<img src="images/castle.png">'),
        ("README.md", "[`a`](docs/build.md)", "[`a`](build.md)"),
        ("README.md", "[a](#scenes)", "[a](#scenes)"),
        ("README.md", "[a](https://example.org/docs/a.md)", "[a](https://example.org/docs/a.md)"),
        ("README.md", "`[a](docs/build.md)`", "`[a](docs/build.md)`"),
        ("README.md", "```md\n[a](docs/build.md)\n```", "```md\n[a](docs/build.md)\n```"),
    ],
)  # fmt: skip
def test_links_are_rewritten(page, link, moved):
    assert rewritten(f"Before\n\n{link} after\n", page) == f"Before\n\n{moved} after\n"


def test_what_pages_link_to_comes_along():
    pages = [one.relative_to(ROOT).as_posix() for one in (ROOT / "docs").rglob("*.md")]
    brought = brought_along(pages)
    assert brought["index.md"] == (ROOT / "README.md").read_text(encoding="utf-8")
    assert "openapi: 3" in brought["repository/openapi.yaml.md"]
    assert "(../../../bench/results/" not in brought["repository/integrations/c/index.md"]
    assert "occluder.h](occluder.h.md)" in brought["repository/integrations/c/index.md"]
    assert "repository/integrations/c/occluder.h.md" in brought  # of the folder's list
    assert not any("__pycache__" in one for one in brought)
    for page in (*repository.ROOTS, *pages):
        text = (ROOT / page).read_text(encoding="utf-8")
        for one in linked(text, page):
            assert site_path(one) in brought or (ROOT / one).is_relative_to(ROOT / "docs")


def test_a_lost_link_is_named_with_its_page(monkeypatch, tmp_path):
    monkeypatch.setattr(repository, "ROOT", tmp_path)
    for name in repository.ROOTS:
        (tmp_path / name).write_text("# Title\n")
    (tmp_path / "CHANGELOG.md").write_text("[a](docs/lost.md)\n")
    with pytest.raises(FileNotFoundError, match=r"^CHANGELOG\.md: links to docs/lost\.md"):
        brought_along([])


@pytest.mark.parametrize(
    ("place", "path"),
    [
        ("index.md", "README.md"),
        ("service.md", "docs/service.md"),
        ("repository/CHANGELOG.md", "CHANGELOG.md"),
        ("repository/openapi.yaml.md", None),
        ("reference/commands/simplify.md", None),
    ],
)
def test_which_pages_have_links_to_rewrite(place, path):
    assert source_of(place) == path
