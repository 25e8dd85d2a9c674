"""Chains of levels to files: one with all, where the format has a place, and one a level."""

from __future__ import annotations

import re
from pathlib import Path

from simplifier.checks import as_path
from simplifier.errors import OutputError
from simplifier.geometry.lod_chain import LodChain
from simplifier.io.atomic import write_all_whole
from simplifier.io.save import check_writable, encoded, encoded_chain
from simplifier.io.style import PLAIN, Style


def save_lods(chain: LodChain, path: str | Path, style: Style = PLAIN) -> tuple[Path, ...]:
    """Write the levels in the format of the suffix, ``NAME_lod0`` and so on beside ``path``.

    For ``.glb``, by the extension MSFT_lod, and ``.occ`` all levels also go to ``path`` itself;
    other formats have no place for them.  Files of the same pattern above the last level, of an
    earlier run, are removed.  Returns the files of the levels, finest first.  All are written or
    none is; raises :class:`OutputError` as :func:`~simplifier.io.save.save_occluder`.
    """
    path = as_path("path", path)
    check_writable(path, style)
    paths = level_paths(path, len(chain.levels))
    files = {
        place: encoded(level.occluder, place, style)
        for place, level in zip(paths, chain.levels, strict=True)
    }
    whole = encoded_chain(chain, path, style)
    if whole is not None:
        files[path] = whole
    write_all_whole(files)
    for stale in _stale(path, len(chain.levels)):
        _remove(stale)
    return paths


def level_paths(path: Path, count: int) -> tuple[Path, ...]:
    """The files of the levels, finest first."""
    return tuple(path.with_name(f"{path.stem}_lod{index}{path.suffix}") for index in range(count))


def is_level_path(path: Path, output: Path) -> bool:
    """Whether ``save_lods`` to ``output`` could replace or remove ``path``."""
    path, output = path.resolve(), output.resolve()
    return path.parent == output.parent and _level_of(path, output) is not None


def _level_of(path: Path, output: Path) -> int | None:
    """The level that a file name stands for, None for any other file."""
    pattern = f"{re.escape(output.stem)}_lod(0|[1-9][0-9]*){re.escape(output.suffix)}"
    found = re.fullmatch(pattern, path.name)
    return int(found[1]) if found else None


def _stale(output: Path, count: int) -> list[Path]:
    """Files of levels from ``count`` on."""
    levels = [(_level_of(path, output), path) for path in output.resolve().parent.iterdir()]
    return [path for level, path in levels if level is not None and level >= count]


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"this level of an earlier run cannot be removed ({error.strerror})",
            where=str(path),
            remedy="remove it: it does not belong to the new levels",
        ) from None
