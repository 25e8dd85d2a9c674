"""Occluders to files, all or nothing.

Chains of levels to files: one with all, where the format has a place, and one a level.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.checks import as_path, check_kind
from simplifier.errors import OutputError
from simplifier.geometry.occluder import AN_OCCLUDER, LodChain, Occluder
from simplifier.io.files import check_folder, write_all_whole, write_whole
from simplifier.io.formats import CODECS, Codec, suffixes_with_quads, writable_suffixes
from simplifier.io.places import followed
from simplifier.io.written_faces import quads_and_triangles, single_sided
from simplifier.options.simplify import PLAIN, Style


def save_occluder(occluder: Occluder, path: str | Path, style: Style = PLAIN) -> None:
    """Write the occluder in the format of the suffix; every format can hold one of 0 faces.

    The file appears whole or not at all, and an old one stays until then; a link is followed.
    ``.ply``, ``.obj``, ``.off`` and ``.tres`` keep float64, ``.glb`` and ``.occ`` keep float32
    relative to the occluder's centre, ``.stl`` float32 in absolute coordinates.  Raises
    :class:`OutputError`, also where float32 would move a corner by more than a thousandth of the
    occluder's longest extent, and for quads in a format without.
    """
    path = as_path("path", path)
    check_kind("occluder", occluder, Occluder, AN_OCCLUDER)
    write_whole(path, occluder_bytes(occluder, path, style))


def occluder_bytes(occluder: Occluder, path: Path, style: Style = PLAIN) -> bytes:
    """What the file is to hold.  Raises :class:`OutputError`."""
    codec = _codec_for_writing(path, style)
    _check(occluder, path)
    styled = _apply_style(occluder, style)
    with _naming_file(path):
        if style.quads and codec.encode_polygons:
            return codec.encode_polygons(styled, *quads_and_triangles(styled))
        return codec.encode(styled) if codec.encode else b""


def chain_bytes(chain: LodChain, path: Path, style: Style = PLAIN) -> bytes | None:
    """What a file with all levels is to hold, None where the format has no place for them.

    Raises :class:`OutputError`.
    """
    codec = _codec_for_writing(path, style)
    if codec.encode_lods is None:
        return None
    for level in chain.levels:
        _check(level.occluder, path)
    levels = tuple(
        replace(level, occluder=_apply_style(level.occluder, style)) for level in chain.levels
    )
    with _naming_file(path):
        return codec.encode_lods(replace(chain, levels=levels))


def _apply_style(occluder: Occluder, style: Style) -> Occluder:
    return single_sided(occluder) if style.sides == "single" else occluder


@contextmanager
def _naming_file(path: Path) -> Iterator[None]:
    """Refusals of an encoder, which does not know the file, with its name."""
    try:
        yield
    except OutputError as error:
        raise OutputError(error.what, where=str(path), remedy=error.remedy) from None


def check_writable(path: str | Path, style: Style = PLAIN) -> None:
    """Raise :class:`OutputError` now for what would keep an occluder from being written later."""
    path = as_path("path", path)
    check_format(path, style)
    check_folder(path)


def check_format(path: Path, style: Style = PLAIN) -> None:
    """As :func:`check_writable`, but the folder need not be there."""
    _codec_for_writing(path, style)


def _codec_for_writing(path: Path, style: Style) -> Codec:
    codec = CODECS.get(path.suffix.lower())
    if codec is None or codec.encode is None:
        raise OutputError(
            f"files that end in '{path.suffix}' cannot be written",
            where=str(path),
            remedy=f"use one of {' '.join(writable_suffixes())}",
        )
    if style.quads and codec.encode_polygons is None:
        raise OutputError(
            f"{codec.name} files have no quads",
            where=str(path),
            remedy=f"write triangles, or one of {' '.join(suffixes_with_quads())}",
        )
    return codec


def _check(occluder: Occluder, path: Path) -> None:
    """What no format can hold."""
    faces = occluder.faces
    if not np.isfinite(occluder.vertices).all():
        raise OutputError(
            "the occluder has a coordinate that is not finite",
            where=str(path),
            remedy="repair its vertices",
        )
    if faces.size and (faces.min() < 0 or faces.max() >= len(occluder.vertices)):
        raise OutputError(
            "the occluder names a vertex that it does not have",
            where=str(path),
            remedy="repair its faces",
        )


def holds_levels(path: Path) -> bool:
    """Whether a file of the suffix holds all levels of detail.  Raises :class:`OutputError`."""
    return _codec_for_writing(path, PLAIN).encode_lods is not None


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
        place: occluder_bytes(level.occluder, place, style)
        for place, level in zip(paths, chain.levels, strict=True)
    }
    whole = chain_bytes(chain, path, style)
    if whole is not None:
        files[path] = whole
    write_all_whole(files)
    remove_levels(path, len(chain.levels))
    return paths


def level_paths(path: Path, count: int) -> tuple[Path, ...]:
    """The files of the levels, finest first."""
    return tuple(path.with_name(f"{path.stem}_lod{index}{path.suffix}") for index in range(count))


def remove_levels(path: Path, count: int) -> None:
    """Remove files of levels from ``count`` on, of an earlier run to ``path``.

    Raises :class:`OutputError`.
    """
    for stale in _stale(path, count):
        _remove(stale)


def is_level_path(path: Path, output: Path) -> bool:
    """Whether ``save_lods`` to ``output`` could replace or remove ``path``."""
    path, output = followed(path), followed(output)
    return path.parent == output.parent and _level_of(path, output) is not None


def _level_of(path: Path, output: Path) -> int | None:
    """The level that a file name stands for, None for any other file."""
    pattern = f"{re.escape(output.stem)}_lod(0|[1-9][0-9]*){re.escape(output.suffix)}"
    found = re.fullmatch(pattern, path.name)
    return int(found[1]) if found else None


def _stale(output: Path, count: int) -> list[Path]:
    """Files of levels from ``count`` on."""
    levels = [(_level_of(path, output), path) for path in followed(output).parent.iterdir()]
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
