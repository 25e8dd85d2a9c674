"""What a shard has made, kept beside the manifest until the records of all are joined:
``occluders.shards/2-of-16.json``.

It holds entries as ``occluders.lock`` does, of what was current, too, so that a join can tell an
asset that was left out.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from simplifier.builds.finding import Finding, State
from simplifier.builds.record import Record, RecordKeeper, parse_entries, record_text, utf8_text
from simplifier.builds.shards import Shard, read_shard
from simplifier.checks import is_finite
from simplifier.errors import ManifestError, OptionError
from simplifier.io.files import make_folder, read_bytes, write_whole
from simplifier.io.places import is_folder
from simplifier.version import VERSION

_SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Making:
    """How the making of an asset went, for the reports of the join."""

    why: str
    seconds: float
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class ShardRecord:
    """``manifest`` is the digest of its text, ``version`` that of the program.

    ``finished``  whether the shard came to its end, with or without assets that failed.
    ``made``      of what this shard made since the last join.
    ``failed``    why, by asset.
    """

    shard: Shard
    manifest: str
    version: str
    finished: bool = False
    entries: Record = field(default_factory=dict)
    made: Mapping[str, Making] = field(default_factory=dict)
    failed: Mapping[str, str] = field(default_factory=dict)


def shards_folder(manifest: Path) -> Path:
    """Beside the manifest: of ``occluders.toml`` it is ``occluders.shards``."""
    return manifest.with_suffix(".shards")


def shard_path(manifest: Path, shard: Shard) -> Path:
    return shards_folder(manifest) / f"{shard.number}-of-{shard.count}.json"


def manifest_digest(manifest: Path) -> str:
    """The same for both kinds of line ends, which version control may change."""
    data = read_bytes(manifest, error=ManifestError, remedy="name a manifest")
    return sha256(data.replace(b"\r\n", b"\n")).hexdigest()


def read_shard_records(manifest: Path) -> dict[Path, ShardRecord]:
    """All that there are; raises :class:`ManifestError` for a damaged one."""
    return {
        path: read_shard_record(path) for path in sorted(shards_folder(manifest).glob("*.json"))
    }


def read_shard_record(path: Path) -> ShardRecord:
    """Raises :class:`ManifestError` for what is not a record of a shard."""
    data = read_bytes(path, error=ManifestError, remedy="remove it")
    try:
        content = json.loads(data)
        if content["schema_version"] != _SCHEMA_VERSION:
            raise ValueError
        return ShardRecord(
            read_shard(content["shard"]),
            utf8_text(content["manifest"]),
            utf8_text(content["version"]),
            content["finished"] is True,
            parse_entries(content),
            {utf8_text(name): _making(one) for name, one in content["made"].items()},
            {utf8_text(name): utf8_text(why) for name, why in content["failed"].items()},
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OptionError):
        raise ManifestError(
            "this is not a record of a shard",
            where=str(path),
            remedy="remove it and build the shard again",
        ) from None


def _making(data: Mapping[str, Any]) -> Making:
    if not is_finite(data["seconds"]):
        raise TypeError
    return Making(utf8_text(data["why"]), data["seconds"], tuple(map(utf8_text, data["warnings"])))


def write_shard_record(path: Path, record: ShardRecord) -> None:
    """Whole or not at all.  Raises :class:`~simplifier.errors.OutputError`."""
    make_folder(path.parent)
    text = record_text(
        record.entries,
        schema_version=_SCHEMA_VERSION,
        shard=str(record.shard),
        manifest=record.manifest,
        version=record.version,
        finished=record.finished,
        made={name: asdict(one) for name, one in record.made.items()},
        failed=dict(record.failed),
    )
    write_whole(path, text.encode())


def check_other_shards(manifest: Path, shard: Shard) -> None:
    """Raises :class:`ManifestError` where records of another number of shards wait to be joined."""
    for file in sorted(shards_folder(manifest).glob("*-of-*.json")):
        count = file.stem.partition("-of-")[2]
        if count != str(shard.count):
            raise ManifestError(
                f"there is a record of one of {count} shards, and this is one of {shard.count}",
                where=str(file),
                remedy=f"join those first, or remove '{file.parent.name}'",
            )


def remove_shard_records(manifest: Path) -> None:
    """All at once, so that a join that is killed leaves all of them or none."""
    folder = shards_folder(manifest)
    aside = folder.with_name(f".{folder.name}.joined")
    shutil.rmtree(aside, ignore_errors=True)
    if is_folder(folder):
        folder.rename(aside)
        shutil.rmtree(aside, ignore_errors=True)


class ShardKeeper(RecordKeeper):
    """The record of a shard while it is made, in its file from the beginning."""

    def __init__(self, manifest: Path, shard: Shard, entries: Record, made: Mapping[str, Making]):
        self._record = ShardRecord(shard, manifest_digest(manifest), VERSION)
        self._made, self._failed = dict(made), dict[str, str]()
        super().__init__(shard_path(manifest, shard), entries)
        self._changed = True
        self.save()

    def note(self, finding: Finding) -> None:
        if finding.state is State.BUILT:
            self._made[finding.asset] = Making(finding.why, finding.seconds, finding.warnings)
        elif finding.state is State.FAILED:
            self._failed[finding.asset] = finding.why
        self._changed = True

    def finish(self) -> None:
        """It came to its end; to be saved."""
        self._record = replace(self._record, finished=True)
        self._changed = True

    def _write(self) -> None:
        write_shard_record(
            self._path,
            replace(self._record, entries=self._entries, made=self._made, failed=self._failed),
        )
