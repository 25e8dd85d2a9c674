"""What a build is told by files: its manifest, and the record of what was made."""

from __future__ import annotations

from pathlib import Path

from simplifier.builds.asset_plan import plan_assets
from simplifier.builds.finding import State
from simplifier.builds.joining import join_shards
from simplifier.builds.manifest import read_manifest
from simplifier.builds.record import Record, parse_record, read_record, write_record
from simplifier.builds.shard_record import read_shard_record, shard_path, write_shard_record
from simplifier.builds.shards import Shard
from simplifier.builds.staleness import check_assets
from simplifier.io.suffixes import OCCLUDER_SUFFIXES
from tests.fuzz.promises import check_sentence, promise

_MESHES = ("wall.obj", "props/crate.ply", "props/wip/chair.glb", "trees/oak.stl")


def check_build_manifest(data: bytes, folder: Path) -> None:
    """``data`` above a few meshes; raises ``OccluderError`` where it is refused."""
    path = _folder(folder / "build") / "occluders.toml"
    path.write_bytes(data)
    assets = plan_assets(read_manifest(path))
    promise({one.name for one in assets} <= set(_MESHES), "assets are meshes that are there")
    files = [file.casefold() for one in assets for file in one.files]
    promise(len(set(files)) == len(files), "no two outputs are one file")
    for file in files:
        place = (path.parent / file).resolve()
        promise(place.is_relative_to(path.parent.resolve()), "outputs stay below the manifest")
        promise(place.suffix in OCCLUDER_SUFFIXES, "and end as occluders do")
        promise(file not in _MESHES, "and replace no mesh")
    found = check_assets(path, {})
    promise([one.asset for one in found] == [one.name for one in assets], "each has a finding")
    for one in found:
        promise(one.state is State.STALE, "nothing was made")
        check_sentence(one.why)


def check_build_record(data: bytes, folder: Path) -> None:
    """``data`` beside a manifest; raises ``OccluderError`` where it is refused."""
    place = _folder(folder / "build")
    (place / "occluders.toml").write_text('[[asset]]\nfiles = "**/*"\n')
    record = parse_record(data, "occluders.lock")
    copy = folder / "copy.lock"
    write_record(copy, record)
    promise(read_record(copy) == record, "a record is the same when it is read again")
    (place / "occluders.lock").write_bytes(data)
    names = {one.asset for one in check_assets(place / "occluders.toml", record)}
    promise(names >= set(_MESHES) - _outputs(record), "whatever it says, all meshes are looked at")


def check_shard_record(data: bytes, folder: Path) -> None:
    """``data`` as the record of the first of two shards; raises ``OccluderError`` where it is
    refused."""
    path = _folder(folder / "build") / "sharded.toml"
    path.write_text('[[asset]]\nfiles = "**/*"\n')
    place = shard_path(path, Shard(1, 2))
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(data)
    record = read_shard_record(place)
    copy = folder / "copy.json"
    write_shard_record(copy, record)
    promise(read_shard_record(copy) == record, "a record is the same when it is read again")
    found = {one.asset for one in check_assets(path, {}, Shard(1, 2))}
    promise(found == {one for one in _MESHES if Shard(1, 2).holds(one)}, "a shard is its own")
    join_shards(path, {})
    promise(False, "one shard of two is not joined")


def _outputs(record: Record) -> set[str]:
    return {file for one in record.values() for file in one.outputs}


def _folder(place: Path) -> Path:
    """Made once: no case writes to the meshes."""
    for name in _MESHES:
        mesh = place / name
        mesh.parent.mkdir(parents=True, exist_ok=True)
        if not mesh.exists():
            mesh.write_bytes(name.encode())
    return place
