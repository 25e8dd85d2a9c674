"""What a manifest asks for, beside what is there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from simplifier.builds.asset_plan import Asset, plan_assets
from simplifier.builds.digests import Digests
from simplifier.builds.finding import Finding, State
from simplifier.builds.manifest import Manifest, read_manifest
from simplifier.builds.record import Record, read_record, record_path
from simplifier.builds.requirements import shortfalls
from simplifier.builds.staleness import asset_output, files_of, reason
from simplifier.kernels.threads import thread_count


@dataclass(frozen=True)
class Examined:
    """``stale``: why each asset that is to be made has to be, by its name."""

    manifest: Manifest
    assets: tuple[Asset, ...]
    record: Record
    stale: Mapping[str, str]

    def leftovers(self, name: str) -> Iterator[str]:
        """Files that were made of an asset, the record says, and that are no output any more."""
        outputs = {one for asset in self.assets for one in asset.files}
        for file in self.record[name].outputs:
            if asset_output(file, outputs) is None:
                yield file


def examine(path: Path, digests: Digests) -> Examined:
    """Raises :class:`~simplifier.errors.ManifestError` for a bad manifest or record."""
    manifest = read_manifest(path)
    record = read_record(record_path(path))
    assets = plan_assets(manifest, {file for one in record.values() for file in one.outputs})
    folder = manifest.folder
    found = digests.all_of(files_of(folder, assets, record), thread_count())
    reasons = ((one.name, reason(folder, one, record.get(one.name), found)) for one in assets)
    return Examined(manifest, assets, record, {name: why for name, why in reasons if why})


def check(path: Path, before: Record) -> list[Finding]:
    """Make nothing: is every output there, current, and as good as is demanded?

    ``before``  the record whose recall counts as what was.  Raises as :func:`examine`.
    """
    seen = examine(path, Digests())
    return [
        *(judged(one, seen.record, seen.stale.get(one.name, ""), before) for one in seen.assets),
        *gone(seen),
    ]


def judged(asset: Asset, record: Record, stale: str, before: Record) -> Finding:
    """One that this run did not make."""
    if stale:
        return Finding(asset.name, State.STALE, stale)
    figures, was = record[asset.name].figures, before.get(asset.name)
    short = shortfalls(asset.requirements, figures, was.figures if was else None)
    return Finding(asset.name, State.CURRENT, "", figures, tuple(short))


def gone(seen: Examined) -> Iterator[Finding]:
    """Those of the record that are no assets any more, where what was made of them is there."""
    names = {asset.name for asset in seen.assets}
    for name in sorted(seen.record.keys() - names):
        left = [one for one in seen.leftovers(name) if (seen.manifest.folder / one).exists()]
        if left:
            yield Finding(name, State.GONE, f"no such asset, and '{left[0]}' is still there")
