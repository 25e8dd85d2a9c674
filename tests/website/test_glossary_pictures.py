"""A picture a term: each is what the script writes, small, and whole."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from tests.acceptance.command import ROOT
from website.glossary_pictures import FOLDER, PICTURES, file_name, main, svg_text

_ROW = re.compile(
    r"^\| !\[([^\]]+), a sketch\]\(images/glossary/([a-z_]+\.svg)\) \| \*\*(.+?)\*\*", re.M
)


def test_every_term_of_the_glossary_has_its_own() -> None:
    text = (ROOT / "docs/glossary.md").read_text("utf-8")
    rows = _ROW.findall(text)
    assert [term for term, _, _ in rows] == [term for _, _, term in rows] == list(PICTURES)
    assert all(file == file_name(term) for term, file, _ in rows)
    assert not re.findall(r"^- \*\*", text, re.M)


def test_what_is_committed_is_what_the_script_writes(tmp_path) -> None:
    main(tmp_path)
    written, committed = (
        {one.name: one.read_bytes() for one in folder.iterdir()}
        for folder in (tmp_path, ROOT / FOLDER)
    )
    assert written == committed
    assert max(map(len, written.values())) < 60_000


@pytest.mark.parametrize("term", PICTURES)
def test_a_sketch_can_be_drawn_and_says_what_it_is(term) -> None:
    root = ElementTree.fromstring(svg_text(term))
    assert root.findtext("{http://www.w3.org/2000/svg}title") == term
    assert len(root) > 3
