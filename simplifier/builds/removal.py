"""What is removed: files that nobody's outputs are any more, where they are as they were made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from simplifier.builds.digests import Digests
from simplifier.builds.record import Entry
from simplifier.builds.staleness import Examined


def remove_gone(seen: Examined) -> Iterator[str]:
    """Remove what was made of meshes that are there no more; the names of their entries."""
    for name in seen.record.keys() - {asset.name for asset in seen.planned}:
        _remove(seen.manifest.folder, seen.record[name], seen.leftovers(name))
        yield name


def remove_replaced(seen: Examined, name: str, old: Entry, new: Iterable[str]) -> None:
    """Of an asset that was made anew, what it was before and is not among its ``new`` files."""
    kept = {*new}
    files = (one for one in old.outputs if one not in kept and not seen.is_of_another(one, name))
    _remove(seen.manifest.folder, old, files)


def _remove(folder: Path, entry: Entry, files: Iterable[str]) -> None:
    digests = Digests()
    for file in files:
        if digests.of(folder / file) == entry.outputs[file]:
            with suppress(OSError):
                (folder / file).unlink()
