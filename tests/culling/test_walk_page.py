"""The page of a walk: whole by itself."""

from __future__ import annotations

import base64
import re

from simplifier.culling.flythrough import fly
from simplifier.culling.walk_file import encode_walk
from simplifier.culling.walk_page import walk_page
from tests.culling.occluded import SMALL, WALL, exact, path_of, street, tree_of

NAME = '<script>alert("a")</script>.glb'


def test_it_has_all_that_it_needs_and_names_are_text():
    scene = street()
    flown = fly(scene, tree_of(scene, {"wall": exact(WALL)}), path_of(), SMALL)
    page = walk_page(flown, NAME)
    data = re.search(r'id="walk-data">([^<]*)<', page)
    assert base64.b64decode(data[1]) == encode_walk(flown, NAME)
    sources = re.findall(r'(?:src|href)="([^"]{0,40})', page)
    assert [one[:28] for one in sources] == ["data:text/javascript;base64,"]
    assert NAME not in page
    assert "&lt;script&gt;alert" in page
    script = base64.b64decode(re.search(r'base64,([^"]*)"', page)[1]).decode()
    assert "class WalkPlayer" in script
    assert not re.search(r"^(import|export)\b", script, re.MULTILINE)
