"""Names of files are labels: nothing in them is a path, hides or misleads."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.uploads.receiving import file_label


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("castle.glb", "castle.glb"),
        ("../../etc/passwd", "passwd"),
        ("C:\\models\\castle.glb", "castle.glb"),
        ("a/b\\c/castle.glb", "castle.glb"),
        ("folder/", ""),
        ("..", ""),
        (" \t. ", ""),
        ("a\0b\r\nc\x7f.obj", "abc.obj"),
        ("evil\u202eblg.exe", "evilblg.exe"),
        ("\u2066a\u2069\ufeff\u200b.stl", "a.stl"),
        ("a\u2028b\ud800.ply", "ab.ply"),
        ("Schloß 城.glb", "Schloß 城.glb"),
        (" spaced.glb ", "spaced.glb"),
        ("x" * 300 + ".glb", "x" * 196 + ".glb"),
        ("." + "x" * 300, "." + "x" * 199),
    ],
)
def test_only_what_people_can_read_is_left(name, label):
    assert file_label(name) == label


@given(st.text(max_size=400))
def test_a_label_is_short_and_plain_and_its_own_label(name):
    label = file_label(name)
    assert len(label) <= 200
    assert not {"/", "\\", "\0"} & set(label)
    assert not any(unicodedata.category(one) in {"Cc", "Cf", "Cs"} for one in label)
    assert label not in {".", ".."}
    assert file_label(label) == label
