"""Pools by name, and what is refused before any work."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from simplifier import pools
from simplifier.errors import OptionError, OutputError
from simplifier.pools import LocalPool, PoolJob, Shared, joined, pool_named


def known(monkeypatch, *found):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: found)


def test_no_name_is_this_machine():
    with pool_named(None) as opened:
        assert opened is None


def test_a_name_that_nobody_has():
    with pytest.raises(OptionError, match=r"^pool: there is no pool 'slurm'; choose ray, or leave"):
        pool_named("slurm")


def test_without_the_package_that_has_pools(monkeypatch):
    known(monkeypatch)
    with pytest.raises(OptionError, match=r"pip install 'planar-occluder\[ray\]'"):
        pool_named("ray")


def test_a_pool_that_lacks_a_package(monkeypatch):
    known(monkeypatch, EntryPoint("far", "no_such_module:pool", pools.POOL_GROUP))
    with pytest.raises(OptionError, match=r"'far' lacks a package \(No module named 'no_such_mod"):
        pool_named("far")


def test_what_is_shared_counts_its_bytes():
    shared = Shared(b"12345", {"a": [np.zeros(3), np.zeros(1)], "b": [np.zeros(2, np.int8)]})
    assert shared.nbytes == 5 + 32 + 2


def test_an_array_in_one_piece_is_not_copied():
    array = np.zeros(3)
    assert joined([array]) is array


def test_a_disk_without_room_ends_it(monkeypatch):
    def full(path, pieces):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pools, "_write_joined", full)
    outcomes = LocalPool(1).run_jobs("builtins:print", Shared(b"", {"a": [np.zeros(1)]}),
                                     [PoolJob(b"")])  # fmt: skip
    with pytest.raises(OutputError, match="No space left on device"):
        list(outcomes)
