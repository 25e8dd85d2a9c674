"""Which assets have to be made again, and why, in words.

What a manifest asks for, beside what is there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

from simplifier.builds.asset_plan import Asset, plan_assets
from simplifier.builds.digests import Digests
from simplifier.builds.finding import Finding, State, shortfalls, unknown_figure
from simplifier.builds.manifest import Manifest, read_manifest
from simplifier.builds.outputs import Output, level_base
from simplifier.builds.record import Entry, Record, read_record, record_path
from simplifier.builds.shard_record import read_shard_record, shard_path
from simplifier.builds.shards import Shard
from simplifier.io.places import is_there
from simplifier.io.suffixes import overrides_place
from simplifier.kernels.threads import thread_count
from simplifier.options.simplify import SimplifyOptions
from simplifier.version import VERSION

_DEFAULTS = {field.name: field.default for field in (*SimplifyOptions.fields(), *Output.fields())}

Found = Mapping[Path, str | None]
"""The digests of files as they are now, None for one that is not there."""


def files_of(folder: Path, assets: Iterable[Asset], record: Record) -> Iterator[Path]:
    """All files that :func:`reason` asks for the digests of."""
    for asset in assets:
        mesh = folder / asset.name
        yield mesh
        entry = record.get(asset.name)
        if entry is not None:
            yield from (mesh.parent / name for name in _beside(mesh, entry))
            yield from (folder / output for output in entry.outputs)


def reason(folder: Path, asset: Asset, entry: Entry | None, found: Found) -> str:
    """Why an asset has to be made, by its last making; empty where it is current."""
    if entry is None:
        return "it was never made"
    mesh = folder / asset.name
    if found[mesh] != entry.mesh:
        return "the mesh has changed"
    for name in _beside(mesh, entry):
        if (found[mesh.parent / name] or "") != entry.beside.get(name, ""):
            return f"'{name}' has changed"
    another = _difference(entry.options, chosen_options(asset.options))
    if another:
        return another
    if entry.version != VERSION:
        return f"version {entry.version} made it, and this is {VERSION}"
    recorded = {asset_output(output, asset.files) or output for output in entry.outputs}
    for file in sorted(recorded.symmetric_difference(asset.files)):
        return f"'{file}' is {'a new' if file in asset.files else 'no more an'} output"
    for one in asset.outputs:
        another = _difference(entry.written.get(one.file, {}), one.written)
        if another:
            return f"'{one.file}': {another}"
    for output, digest in entry.outputs.items():
        now = found[folder / output]
        if now != digest:
            return f"'{output}' is missing" if now is None else f"'{output}' was changed"
    unknown = unknown_figure(asset.requirements, entry.figures)
    return f"its record is from before the {unknown} was kept" if unknown else ""


def _beside(mesh: Path, entry: Entry) -> list[str]:
    """What counts beside a mesh; overrides also where there were none."""
    return sorted({*entry.beside, overrides_place(mesh).name})


def asset_output(file: str, outputs: Collection[str]) -> str | None:
    """Which of an asset's outputs a file is, or holds a level of detail of, if any."""
    if file in outputs:
        return file
    base = level_base(file)
    return base if base in outputs else None


def chosen_options(options: SimplifyOptions) -> dict[str, Any]:
    """Those that differ from their defaults, as JSON has them."""
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in asdict(options).items()
        if value != _DEFAULTS[name]
    }


def _difference(was: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """The first of some options that is another one, in words; empty where none is."""
    for name in sorted(was.keys() | now.keys()):
        before, after = (options.get(name, _DEFAULTS.get(name)) for options in (was, now))
        if before != after:
            return f"{name} was {_word(before)} and is {_word(after)}"
    return ""


def _word(value: Any) -> str:
    return "not set" if value is None else str(value)


@dataclass(frozen=True)
class Plan:
    """What a manifest asks for, and the record beside it."""

    manifest: Manifest
    record: Record
    assets: tuple[Asset, ...]


def make_plan(path: Path) -> Plan:
    """Raises :class:`~simplifier.errors.ManifestError` for a bad manifest or record."""
    manifest = read_manifest(path)
    record = read_record(record_path(path))
    made = {file for one in record.values() for file in one.outputs}
    return Plan(manifest, record, plan_assets(manifest, made))


def files_of_plan(path: Path) -> Iterator[tuple[Path, str]]:
    """What a build reads and writes, each with what it is: its manifest first, at ``path``.

    Raises as :func:`make_plan`.
    """
    yield path, "the manifest itself"
    yield record_path(path), "the record of the build"
    plan = make_plan(path)
    folder = plan.manifest.folder
    for asset in plan.assets:
        mesh = folder / asset.name
        yield mesh, f"the mesh '{asset.name}'"
        yield overrides_place(mesh), "a file of overrides"
        yield from ((folder / file, f"an output of '{asset.name}'") for file in asset.files)
    for one in plan.record.values():
        yield from ((folder / file, "an output of the build") for file in one.outputs)


@dataclass(frozen=True)
class Examined:
    """``planned``  all assets of the manifest.
    ``assets``   those of them that were looked at.
    ``record``   what is known of each.
    ``stale``    why each asset that is to be made has to be, by its name.
    """

    manifest: Manifest
    planned: tuple[Asset, ...]
    assets: tuple[Asset, ...]
    record: Record
    stale: Mapping[str, str]

    def leftovers(self, name: str) -> Iterator[str]:
        """Files that were made of an asset, the record says, and that are no output any more."""
        return (file for file in self.record[name].outputs if self._owner(file) is None)

    def is_of_another(self, file: str, name: str) -> bool:
        """Whether a file is an output, or one's level of detail, of another asset."""
        return self._owner(file) not in (None, name)

    def _owner(self, file: str) -> str | None:
        output = asset_output(file, self._owners)
        return None if output is None else self._owners[output]

    @cached_property
    def _owners(self) -> Mapping[str, str]:
        return {output: asset.name for asset in self.planned for output in asset.files}


def examine(
    plan: Plan, digests: Digests, *, shard: Shard | None = None, newer: Record | None = None
) -> Examined:
    """``shard``  look at its assets alone.
    ``newer``  entries in place of those of the record by which an asset is not current.
    """
    assets = tuple(one for one in plan.assets if shard is None or shard.holds(one.name))
    folder, newer, record = plan.manifest.folder, newer or {}, dict(plan.record)
    files = chain(files_of(folder, assets, record), files_of(folder, assets, newer))
    found = digests.all_of(files, thread_count())
    stale = {}
    for one in assets:
        why = reason(folder, one, record.get(one.name), found)
        if why and one.name in newer:
            record[one.name] = newer[one.name]
            why = reason(folder, one, newer[one.name], found)
        if why:
            stale[one.name] = why
    return Examined(plan.manifest, plan.assets, assets, record, stale)


def examine_shard(path: Path, shard: Shard | None, digests: Digests) -> Examined:
    """What an earlier run of the shard has made is known, too; without a shard all is examined.

    Raises :class:`~simplifier.errors.ManifestError` for a bad manifest or record.
    """
    plan = make_plan(path)
    newer = None
    if shard is not None and is_there(shard_path(path, shard)):
        newer = read_shard_record(shard_path(path, shard)).entries
    return examine(plan, digests, shard=shard, newer=newer)


def check_assets(path: Path, before: Record, shard: Shard | None = None) -> list[Finding]:
    """Make nothing: is every output there, current, and as good as is demanded?

    ``before``  the record whose recall counts as what was.
    ``shard``   whose assets alone are looked at; what is gone is told by a check of all.

    Raises as :func:`examine_shard`.
    """
    seen = examine_shard(path, shard, Digests())
    return [
        *(
            judge_unmade(one, seen.record, seen.stale.get(one.name, ""), before)
            for one in seen.assets
        ),
        *(find_gone(seen) if shard is None else ()),
    ]


def judge_unmade(asset: Asset, record: Record, stale: str, before: Record) -> Finding:
    """One that this run did not make."""
    if stale:
        return Finding(asset.name, State.STALE, stale)
    figures, was = record[asset.name].figures, before.get(asset.name)
    short = shortfalls(asset.requirements, figures, was.figures if was else None)
    return Finding(asset.name, State.CURRENT, "", figures, tuple(short))


def find_gone(seen: Examined) -> Iterator[Finding]:
    """Those of the record that are no assets any more, where what was made of them is there."""
    names = {asset.name for asset in seen.planned}
    for name in sorted(seen.record.keys() - names):
        left = [one for one in seen.leftovers(name) if is_there(seen.manifest.folder / one)]
        if left:
            yield Finding(name, State.GONE, f"no such asset, and '{left[0]}' is still there")
