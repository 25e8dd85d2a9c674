"""Patterns name what the standard library's glob names, and lead nowhere else."""

from __future__ import annotations

import os
import string
from contextlib import suppress
from glob import glob

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.builds.globs import Glob, mesh_files
from simplifier.errors import ManifestError

NAMES = st.sampled_from(["a", "b", "ab", "ba", "A", "a.b", "[", "a-b", "^", "é"])
PATHS = st.lists(st.lists(NAMES, min_size=1, max_size=3).map("/".join), max_size=8)
PIECES = st.sampled_from(["a", "b", "*", "?", "[ab]", "[!a]", "[[]", "[]a]", "[a-c]", "[", "^"])
WORDS = st.lists(PIECES, min_size=1, max_size=4).map("".join)
PATTERNS = st.lists(st.one_of(st.just("**"), NAMES, WORDS), min_size=1, max_size=3).map("/".join)


@given(paths=PATHS, text=PATTERNS)
def test_they_are_those_of_the_standard_library(tmp_path_factory, paths, text):
    if not all(text.split("/")) or ".." in text or "." in text.split("/"):
        return
    folder = tmp_path_factory.mktemp("tree", numbered=True)
    for path in paths:
        file = folder / f"{path}.glb"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    text += ".glb"
    pattern = Glob(text, "")
    mine = {path for path in mesh_files(folder, [pattern]) if pattern.matches(path)}
    theirs = glob(text, root_dir=folder, recursive=True)  # noqa: PTH207
    assert mine == {path.replace(os.sep, "/") for path in theirs}


def test_folders_alone_name_all_below():
    pattern = Glob("props/**", "")
    assert pattern.matches("props/a.glb")
    assert pattern.matches("props/a/b/c.glb")
    assert not pattern.matches("prop/a.glb")


@pytest.mark.parametrize(
    "text", ["/a.glb", "../a.glb", "a/../../b.glb", "a//b.glb", "C:/a.glb", "a\\b.glb", "a/"]
)
def test_what_leads_out_of_the_folder_is_refused(text):
    with pytest.raises(ManifestError, match=r"^m\.toml:3: .* is not a path below"):
        Glob(text, "m.toml:3")


def test_what_is_no_pattern_is_refused():
    with pytest.raises(ManifestError, match=r"^m\.toml:3: '\[z-a\]' is not a pattern"):
        Glob("[z-a]", "m.toml:3")


@given(text=st.text(string.printable, max_size=8))
def test_any_text_is_a_pattern_or_refused(text):
    with suppress(ManifestError):
        Glob(text, "").matches("a/b.glb")


def test_only_what_may_be_named_is_walked(tmp_path):
    for path in ("art/a.glb", "art/.hidden/b.glb", "art/.c.glb", "art/d.png", "art/e.GLB", "x.glb"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    (tmp_path / "art" / "round").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "art" / "link.glb").symlink_to(tmp_path / "x.glb")
    patterns = [Glob(text, "") for text in ("art/**/*.glb", "art/*", "art/none/*.glb")]
    assert mesh_files(tmp_path, patterns) == ["art/a.glb", "art/e.GLB", "art/link.glb"]
