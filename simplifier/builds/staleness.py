"""Which assets have to be made again, and why, in words."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from simplifier.builds.asset_plan import Asset
from simplifier.builds.outputs import WRITING_FIELDS, level_base
from simplifier.builds.record import Entry, Record
from simplifier.option_fields import SIMPLIFY_FIELDS
from simplifier.overrides_place import overrides_place
from simplifier.production.options import SimplifyOptions
from simplifier.version import VERSION

_DEFAULTS = {field.name: field.default for field in (*SIMPLIFY_FIELDS, *WRITING_FIELDS)}

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
    return ""


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
