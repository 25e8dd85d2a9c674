"""What stands at a path, also where the system does not tell."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from simplifier.io.places import followed, is_file, is_folder, is_there, names_in
from tests.acceptance.command import ROOT


@pytest.fixture
def places(tmp_path):
    """A file, a folder, a link to each, links in a circle, and names that the system refuses."""
    (tmp_path / "file").write_bytes(b"x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "to_file").symlink_to("file")
    (tmp_path / "to_folder").symlink_to("folder")
    (tmp_path / "circle").symlink_to("circle")
    names = ("file", "folder", "to_file", "to_folder", "circle", "n" * 300, "nul\0", "missing")
    return {name[:10]: tmp_path / name for name in names}


def test_what_stands_there(places):
    def of(ask):
        return {name for name, path in places.items() if ask(path)}

    assert of(is_file) == {"file", "to_file"}
    assert of(is_folder) == {"folder", "to_folder"}
    assert of(is_there) == {"file", "to_file", "folder", "to_folder"}


def test_what_lies_there(places):
    (places["folder"] / "within").write_bytes(b"x")
    for name, path in places.items():
        assert names_in(path) == (["within"] if name in ("folder", "to_folder") else [])


def test_what_is_in_a_closed_folder_is_not_seen(places, monkeypatch):
    def closed(path, **given):
        raise PermissionError(13, "Permission denied", path)

    monkeypatch.setattr("os.stat", closed)
    assert not any(ask(places["file"]) for ask in (is_file, is_folder, is_there))


def test_links_are_followed_and_a_circle_stays_as_it_is(places):
    folder = places["file"].parent.resolve()
    assert followed(places["to_file"]) == folder / "file"
    assert followed(places["to_folder"] / "inside") == folder / "folder" / "inside"
    assert followed(places["circle"] / "inside") == folder / "circle" / "inside"
    assert followed(places["missing"]) == folder / "missing"


def test_paths_that_users_name_are_asked_about_here():
    """What ``pathlib`` asks ends with an error of the system for a name that is too long."""
    asks = re.compile(r"\.(is_file|is_dir|exists)\(\)")
    elsewhere = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "simplifier").rglob("*.py")
        if asks.search(path.read_text())
    }
    assert all(Path(one).is_relative_to("simplifier/kernels") for one in elsewhere), elsewhere
