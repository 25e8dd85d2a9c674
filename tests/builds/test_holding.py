from __future__ import annotations

import errno
import os
from contextlib import ExitStack

import pytest

from simplifier.builds import holding
from simplifier.builds.holding import shard_build, whole_build
from simplifier.builds.shards import Shard
from simplifier.errors import OutputError

ONE, TWO = Shard(1, 2), Shard(2, 2)


def refused(message):
    return pytest.raises(OutputError, match=message)


def test_shards_are_held_at_once_and_each_once(tmp_path):
    with shard_build(tmp_path, ONE), shard_build(tmp_path, TWO):
        with refused("another build of shard 2/2 of this folder is running"):
            ExitStack().enter_context(shard_build(tmp_path, TWO))
        with refused("another build of this folder is running"):
            ExitStack().enter_context(whole_build(tmp_path))
    with whole_build(tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_a_whole_build_keeps_shards_and_other_builds_out(tmp_path):
    with whole_build(tmp_path):
        with refused("a whole build of this folder is running"):
            ExitStack().enter_context(shard_build(tmp_path, ONE))
        with refused("another build of this folder is running"):
            ExitStack().enter_context(whole_build(tmp_path))
    assert not list(tmp_path.iterdir())
    with shard_build(tmp_path, ONE):
        pass


def test_a_file_that_its_holder_removes_at_that_moment_is_no_lock(tmp_path, monkeypatch):
    """Whoever opened it before would else hold what nobody sees."""
    opened, first = os.open, True

    def open_late(path, *arguments):
        nonlocal first
        held = opened(path, *arguments)
        if first:
            first = False
            path.unlink()
        return held

    monkeypatch.setattr(holding.os, "open", open_late)
    with whole_build(tmp_path), refused("another build of this folder is running"):
        ExitStack().enter_context(whole_build(tmp_path))
    assert not first


def test_a_file_system_without_locks_is_built_on(tmp_path, monkeypatch):
    def flock(*_):
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr(holding.fcntl, "flock", flock)
    with whole_build(tmp_path), shard_build(tmp_path, ONE):
        pass


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with refused("cannot be written to"), whole_build(tmp_path / "none"):
        pass
