from __future__ import annotations

import json

import pytest

from simplifier.builds.shard_record import (
    Making,
    ShardRecord,
    read_shard_record,
    remove_shard_records,
    shard_path,
    shards_folder,
    write_shard_record,
)
from simplifier.builds.shards import Shard
from simplifier.errors import ManifestError

RECORD = ShardRecord(
    Shard(2, 3), "ab", "1", True, {}, {"a.obj": Making("it was never made", 1.5, ("weak",))},
    {"ü.obj": "it is open"},
)  # fmt: skip


def test_it_is_the_same_when_it_is_read_again(tmp_path):
    place = shard_path(tmp_path / "occluders.toml", RECORD.shard)
    write_shard_record(place, RECORD)
    assert place == tmp_path / "occluders.shards" / "2-of-3.json"
    assert read_shard_record(place) == RECORD


@pytest.mark.parametrize(
    "change",
    [{"shard": "4/3"}, {"shard": 2}, {"schema_version": 2}, {"made": {"a.obj": {}}},
     {"failed": {"a.obj": "\ud800"}}, {"failed": {"a.obj": 1}}, {"assets": []},
     {"made": {"a.obj": {"why": "", "seconds": "1", "warnings": []}}}],
)  # fmt: skip
def test_a_damaged_one_is_refused(tmp_path, change):
    place = tmp_path / "2-of-3.json"
    write_shard_record(place, RECORD)
    place.write_text(json.dumps({**json.loads(place.read_text()), **change}))
    with pytest.raises(
        ManifestError, match=r"2-of-3\.json: this is not a record of a shard; remove"
    ):
        read_shard_record(place)


def test_all_go_at_once_and_what_a_killed_join_left_goes_too(tmp_path):
    manifest = tmp_path / "occluders.toml"
    left = tmp_path / ".occluders.shards.joined" / "1-of-3.json"
    for place in (left, shard_path(manifest, RECORD.shard)):
        write_shard_record(place, RECORD)
    remove_shard_records(manifest)
    assert not list(tmp_path.iterdir())
    remove_shard_records(manifest)
    assert not shards_folder(manifest).exists()
