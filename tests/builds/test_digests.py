"""Digests of files: what is read again, and what is not."""

from __future__ import annotations

import hashlib
import json
import os
import time

import pytest

from simplifier.builds import digests as module
from simplifier.builds.digests import Digests

LONG_AGO = 3_000_000_000  # ns: before that, a file is as it will stay


@pytest.fixture
def read(monkeypatch):
    """The files that were read."""
    names = []
    plain = module._digest
    monkeypatch.setattr(module, "_digest", lambda name: names.append(name) or plain(name))
    return names


@pytest.fixture
def later(monkeypatch):
    """Seconds after what was written just now; a time of a file cannot be put back."""
    now = time.time_ns
    monkeypatch.setattr(module.time, "time_ns", lambda: now() + LONG_AGO)


def written(path, text):
    path.write_text(text)
    return hashlib.sha256(text.encode()).hexdigest()


def test_what_was_not_written_is_not_read_again(tmp_path, read, later):
    path = tmp_path / "a"
    expected = written(path, "one")
    digests = Digests()
    assert [digests.of(path), digests.of(str(path))] == [expected, expected]
    assert read == [str(path)]


def test_what_was_written_just_now_may_be_written_again_at_the_same_moment(tmp_path, read):
    path = tmp_path / "a"
    expected = written(path, "one")
    digests = Digests()
    assert [digests.of(path), digests.of(path)] == [expected, expected]
    assert read == [str(path)] * 2
    assert digests.stamps([str(path)]) == {}


def test_a_change_is_seen_though_size_and_time_are_put_back(tmp_path, later):
    path = tmp_path / "a"
    digests = Digests()
    expected = written(path, "one")
    assert digests.of(path) == expected
    before = path.stat()
    time.sleep(0.02)  # longer than a tick of the file system
    expected = written(path, "two")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert digests.of(path) == expected


def test_another_run_reads_nothing_that_this_one_knew(tmp_path, read, later):
    paths = [str(tmp_path / name) for name in "abc"]
    expected = {path: written(tmp_path / path[-1], path) for path in paths}
    first = Digests()
    assert first.all_of(paths, threads=2) == expected
    kept = json.loads(json.dumps([expected, first.stamps(paths)]))
    read.clear()
    second = Digests()
    second.remember(*kept)
    assert second.all_of(paths, threads=2) == expected
    assert read == []
    time.sleep(0.02)
    expected[paths[1]] = written(tmp_path / "b", "another")
    assert second.all_of(paths, threads=2) == expected
    assert read == [paths[1]]


@pytest.mark.parametrize(
    ("digests", "stamps"),
    [({}, {"a": [1, 2, 3, 4]}), ({"a": "0"}, {"a": [1, 2, 3]}), ({"a": "0"}, {"a": 5}), ({}, None)],
)
def test_what_no_run_gave_is_refused(digests, stamps):
    with pytest.raises((ValueError, TypeError, KeyError, AttributeError)):
        Digests().remember(digests, stamps)


def test_what_is_not_there_has_none(tmp_path):
    assert Digests().of(tmp_path / "none") is None
    assert Digests().of("a\0b") is None
    assert Digests().of(tmp_path) is None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are of Unix")
def test_what_might_never_end_has_none(tmp_path):
    """A glTF file that named /dev/zero took all memory, and one that named a pipe never ended."""
    os.mkfifo(tmp_path / "pipe")
    assert Digests().of(tmp_path / "pipe") is None
    assert Digests().of(os.devnull) is None


def test_a_pointer_counts_as_the_file_that_it_stands_for(tmp_path):
    path = tmp_path / "a.glb"
    path.write_text(
        f"version https://git-lfs.github.com/spec/v1\noid sha256:{'5' * 64}\nsize 7\n", newline="\n"
    )
    assert Digests().of(path) == "5" * 64
