"""Records of shards to one record: every asset once, of one manifest and one program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from simplifier.builds.asset_plan import Asset
from simplifier.builds.digests import Digests
from simplifier.builds.finding import Finding, State
from simplifier.builds.holding import whole_build
from simplifier.builds.record import Entry, Record, record_path, write_record
from simplifier.builds.removal import remove_gone, remove_replaced
from simplifier.builds.shard_record import (
    ShardRecord,
    manifest_digest,
    read_shard_records,
    remove_shard_records,
    shard_path,
    shards_folder,
)
from simplifier.builds.shards import Shard, shard_number
from simplifier.builds.staleness import Examined, Plan, examine, find_gone, judge_unmade, make_plan
from simplifier.errors import ManifestError
from simplifier.io.places import followed
from simplifier.version import VERSION

_NAMED = 3  # of many: the others are counted


def join_shards(path: Path, before: Record) -> list[Finding]:
    """What a whole build of the manifest would have found, with what its shards have made.

    The record has what theirs had, theirs are removed, and so is what was made of assets that are
    there no more.  An asset that failed in its shard is told as such, and costs no other.  Where
    there are no records any more and all is current, as after an earlier join, nothing is done.

    ``before``  the record whose recall counts as what was.

    Raises :class:`ManifestError` where a shard is missing or not finished, where records are of
    another manifest, program or number of shards, or where they do not have each asset once; and
    :class:`~simplifier.errors.OutputError` where a build runs or the record cannot be written.
    Nothing is changed then.
    """
    with whole_build(followed(path).parent):
        records = read_shard_records(path)
        plan = make_plan(path)
        if records:
            shards = _checked(path, records)
            _check_assets(path, plan, shards)
        else:
            shards = {}
        entries = {name: one for record in shards.values() for name, one in record.entries.items()}
        seen = examine(plan, Digests(), newer=entries)
        if not shards:
            return _already_joined(path, seen, before)
        findings = [_finding(one, seen, shards, before) for one in seen.assets]
        _put_in_place(path, plan, seen)
    return findings


def _already_joined(path: Path, seen: Examined, before: Record) -> list[Finding]:
    gone = list(find_gone(seen))
    if seen.stale or gone:
        raise ManifestError(
            f"there are no records of shards in '{shards_folder(path).name}'",
            where=str(path),
            remedy="run 'occluder build --shard 1/N' and so on to N/N first, or bring what they "
            "wrote here",
        )
    return [judge_unmade(one, seen.record, "", before) for one in seen.assets]


def _checked(path: Path, records: Mapping[Path, ShardRecord]) -> dict[Shard, ShardRecord]:
    """Records by shard, one of each."""
    folder = shards_folder(path)
    counts = sorted({one.shard.count for one in records.values()})
    if len(counts) > 1:
        words = " and of ".join(f"{count:,}" for count in counts)
        raise ManifestError(
            f"there are records of {words} shards",
            where=str(folder),
            remedy="remove those of all numbers but one, and build what is missing then",
        )
    files: dict[Shard, Path] = {}
    for file, record in records.items():
        if record.shard in files:
            raise ManifestError(
                f"shard {record.shard} is recorded twice, in '{files[record.shard].name}' and "
                f"'{file.name}'",
                where=str(folder),
                remedy="remove one of them",
            )
        files[record.shard] = file
    shards = {shard: records[file] for shard, file in files.items()}
    every = [Shard(number, counts[0]) for number in range(1, counts[0] + 1)]
    _refuse(path, [one for one in every if one not in shards], "has no record here", bring=True)
    unfinished = [one for one in every if not shards[one].finished]
    _refuse(path, unfinished, "did not come to its end")
    digest = manifest_digest(path)
    others = [one for one in every if shards[one].manifest != digest]
    _refuse(path, others, f"was built of another '{path.name}' than the one that is here")
    for one in every:
        if shards[one].version != VERSION:
            _refuse(
                path, [one], f"was built by version {shards[one].version}, and this is {VERSION}"
            )
    return shards


def _check_assets(path: Path, plan: Plan, shards: Mapping[Shard, ShardRecord]) -> None:
    """Each asset in the record of its shard, and no other."""
    count = next(iter(shards)).count
    wanted: dict[Shard, set[str]] = {shard: set() for shard in shards}
    for asset in plan.assets:
        wanted[Shard(shard_number(asset.name, count), count)].add(asset.name)
    for shard, record in sorted(shards.items()):
        told = record.entries.keys() | record.failed.keys()
        for name in sorted(told - wanted[shard]):
            proper = Shard(shard_number(name, count), count)
            if proper != shard:
                raise ManifestError(
                    f"shard {shard} has '{name}', which is of shard {proper}",
                    where=str(shard_path(path, shard)),
                    remedy=f"remove this record and run: {_command(path, shard)}",
                )
        _check_same(path, shard, "is not an asset here", told - wanted[shard])
        _check_same(path, shard, "is not in its record", wanted[shard] - told)


def _check_same(path: Path, shard: Shard, what: str, names: Iterable[str]) -> None:
    listed = sorted(names)
    if listed:
        more = f", as with {len(listed) - 1:,} more" if len(listed) > 1 else ""
        raise ManifestError(
            f"'{listed[0]}' of shard {shard} {what}{more}: meshes came or went meanwhile",
            where=str(shard_path(path, shard)),
            remedy=f"see to it that the meshes are all here, and run: {_command(path, shard)}",
        )


def _refuse(path: Path, shards: Sequence[Shard], what: str, *, bring: bool = False) -> None:
    """Raise for shards, if there are any."""
    if not shards:
        return
    named = ", ".join(map(str, shards[:_NAMED]))
    more = f" (and {len(shards) - _NAMED:,} more)" if len(shards) > _NAMED else ""
    brought = (
        f", or bring its outputs and '{shard_path(path, shards[0]).name}' here" if bring else ""
    )
    raise ManifestError(
        f"shard {named}{more} {what}",
        where=str(shards_folder(path)),
        remedy=f"run: {_command(path, shards[0])}{brought}",
    )


def _command(path: Path, shard: Shard) -> str:
    return f"occluder build {path} --shard {shard}"


def _finding(
    asset: Asset, seen: Examined, shards: Mapping[Shard, ShardRecord], before: Record
) -> Finding:
    count = next(iter(shards)).count
    record = shards[Shard(shard_number(asset.name, count), count)]
    why = seen.stale.get(asset.name, "")
    if why and asset.name in record.failed:
        return Finding(asset.name, State.FAILED, record.failed[asset.name])
    found, making = judge_unmade(asset, seen.record, why, before), record.made.get(asset.name)
    if why or making is None:
        return found
    return replace(
        found, state=State.BUILT, why=making.why, seconds=making.seconds, warnings=making.warnings
    )


def _put_in_place(path: Path, plan: Plan, seen: Examined) -> None:
    names = {asset.name for asset in seen.planned}
    joined = {name: entry for name, entry in seen.record.items() if name in names}
    if joined != plan.record:
        write_record(record_path(path), joined)
    for name, old in plan.record.items():
        if name in names and not _same_files(old, joined[name]):
            remove_replaced(seen, name, old, joined[name].outputs)
    for _ in remove_gone(seen):
        pass  # its entry is out of the record already
    remove_shard_records(path)


def _same_files(old: Entry, new: Entry) -> bool:
    return old.outputs.keys() == new.outputs.keys()
