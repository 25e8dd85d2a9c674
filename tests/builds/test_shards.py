from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.builds.shards import Shard, read_shard, shard_number
from simplifier.errors import OptionError


@given(st.text(min_size=1), st.integers(1, 40))
def test_each_asset_is_of_one_shard(name, count):
    assert [Shard(i + 1, count).holds(name) for i in range(count)].count(True) == 1


def test_shards_are_the_same_on_every_machine_and_in_every_release():
    names = ["props/box.glb", "props/ball.glb", "a.obj", "häuser/turm.glb", "\udcff.obj"]
    assert [shard_number(one, 16) for one in names] == [14, 15, 13, 1, 2]


def test_shards_are_about_as_large_as_one_another():
    sizes = Counter(shard_number(f"props/{i:05}.glb", 10) for i in range(10_000))
    assert sorted(sizes) == list(range(1, 11))
    assert max(abs(size - 1000) for size in sizes.values()) < 120  # four standard deviations


def test_a_shard_is_written_as_it_is_read():
    assert read_shard("2/16") == Shard(2, 16)
    assert str(Shard(2, 16)) == "2/16"


@pytest.mark.parametrize(
    "text", ["0/4", "5/4", "1/0", "-1/4", "1", "1/", "/4", "a/b", "1/4/2", " 1/4", "1.0/4", "²/4",
             "1/1000001", ""],
)  # fmt: skip
def test_what_is_no_shard_is_refused(text):
    with pytest.raises(OptionError, match="is not a shard; write I/N, with I from 1 to N"):
        read_shard(text)
