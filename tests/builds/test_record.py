"""The record: its text, read back, merged, and refused where it is damaged."""

from __future__ import annotations

import json
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.accuracy.verdict import VERDICT_WORDS
from simplifier.builds.finding import AssetFigures
from simplifier.builds.record import Entry, parse_record, read_record, write_record
from simplifier.errors import ManifestError

SHARES = st.floats(0.0, 1.0)
FIGURES = st.builds(
    AssetFigures, st.integers(0, 100_000), SHARES, SHARES, SHARES, st.one_of(st.none(), SHARES),
    st.one_of(st.none(), SHARES), st.sampled_from([None, *VERDICT_WORDS]),
)  # fmt: skip
HASHES = st.dictionaries(st.text(max_size=5), st.text("0123456789abcdef", max_size=8), max_size=3)
OPTIONS = st.dictionaries(
    st.sampled_from(["budget", "up", "error_bounds"]),
    st.one_of(st.integers(), st.text(max_size=3), st.lists(SHARES, max_size=2), st.booleans()),
)
WRITTEN = st.dictionaries(st.text(max_size=5), OPTIONS, max_size=2)
ENTRIES = st.builds(
    Entry, st.text(max_size=8), HASHES, OPTIONS, st.just("1"), HASHES, FIGURES, WRITTEN
)
RECORDS = st.dictionaries(st.text(max_size=8), ENTRIES, max_size=4)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("record") / "occluders.lock"


@given(record=RECORDS)
def test_what_is_written_is_read_back_and_has_one_text(place, record):
    write_record(place, record)
    text = place.read_bytes()
    assert read_record(place) == record
    write_record(place, dict(reversed(record.items())))
    assert place.read_bytes() == text


def entry(recall):
    figures = AssetFigures(12, 0.99, recall, 0.5, None)
    return Entry("ab", {}, {"budget": 12}, "1", {"out.glb": "cd"}, figures)


def test_changes_of_different_assets_merge(tmp_path):
    """Neighbours changed on two branches, and another asset added on each."""
    names = ["a.glb", "b.glb", "z.glb"]
    base = dict.fromkeys(names, entry(0.5))
    ours = base | {"a.glb": entry(0.6), "aa.glb": entry(0.1)}
    theirs = base | {"b.glb": entry(0.7), "bb.glb": entry(0.2)}
    for name, record in (("base", base), ("ours", ours), ("theirs", theirs)):
        write_record(tmp_path / name, record)
    merged = subprocess.run(
        ["git", "merge-file", "-p", "ours", "base", "theirs"],
        cwd=tmp_path, capture_output=True, check=True,
    ).stdout  # fmt: skip
    assert parse_record(merged, "") == base | ours | {n: theirs[n] for n in ("b.glb", "bb.glb")}


def test_a_record_from_before_overhang_was_kept_is_read(tmp_path):
    path = tmp_path / "occluders.lock"
    write_record(path, {"a.glb": entry(0.5)})
    content = json.loads(path.read_bytes())
    figures = content["assets"]["a.glb"]["figures"]
    del figures["overhang"], figures["verdict"]
    assert parse_record(json.dumps(content).encode(), "") == {"a.glb": entry(0.5)}
    figures["verdict"] = "excellent"
    with pytest.raises(ManifestError, match="not a record"):
        parse_record(json.dumps(content).encode(), "")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not a record"),
        (b"[]", "not a record"),
        (b"{" * 100_000, "not a record"),
        (b'{"assets": {}}', "not a record"),
        (b'{"assets": {"a": 3}, "schema_version": 1}', "not a record"),
        (b'{"assets": {"a": {"mesh": "x"}}, "schema_version": 1}', "not a record"),
        (b'{"assets": {}, "schema_version": 2}', "schema_version is 2"),
        (b'{\n<<<<<<< HEAD\n "assets"', "lock:2: two changes of it were not merged; take either"),
    ],
)
def test_a_damaged_one_is_refused(data, words):
    with pytest.raises(ManifestError, match=words) as refused:
        parse_record(data, "occluders.lock")
    assert refused.value.remedy
