"""Occluders to files, all or nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.checks import as_path, check_kind
from simplifier.errors import OutputError
from simplifier.geometry.lod_chain import LodChain
from simplifier.geometry.occluder import AN_OCCLUDER, Occluder
from simplifier.io.atomic import check_folder, write_whole
from simplifier.io.formats import CODECS, Codec, suffixes_with_quads, writable_suffixes
from simplifier.io.quad_pairs import quads_and_triangles
from simplifier.io.sides import single_sided
from simplifier.io.style import PLAIN, Style


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
    write_whole(path, encoded(occluder, path, style))


def encoded(occluder: Occluder, path: Path, style: Style = PLAIN) -> bytes:
    """What the file is to hold.  Raises :class:`OutputError`."""
    codec = _codec_for_writing(path, style)
    _check(occluder, path)
    styled = _styled(occluder, style)
    with _placed(path):
        if style.quads and codec.encode_polygons:
            return codec.encode_polygons(styled, *quads_and_triangles(styled))
        return codec.encode(styled) if codec.encode else b""


def encoded_chain(chain: LodChain, path: Path, style: Style = PLAIN) -> bytes | None:
    """What a file with all levels is to hold, None where the format has no place for them.

    Raises :class:`OutputError`.
    """
    codec = _codec_for_writing(path, style)
    if codec.encode_lods is None:
        return None
    for level in chain.levels:
        _check(level.occluder, path)
    levels = tuple(
        replace(level, occluder=_styled(level.occluder, style)) for level in chain.levels
    )
    with _placed(path):
        return codec.encode_lods(replace(chain, levels=levels))


def _styled(occluder: Occluder, style: Style) -> Occluder:
    return single_sided(occluder) if style.sides == "single" else occluder


@contextmanager
def _placed(path: Path) -> Iterator[None]:
    """Refusals of an encoder, which does not know the file, with its name."""
    try:
        yield
    except OutputError as error:
        raise OutputError(error.what, where=str(path), remedy=error.remedy) from None


def check_writable(path: str | Path, style: Style = PLAIN) -> None:
    """Raise :class:`OutputError` now for what would keep an occluder from being written later."""
    path = as_path("path", path)
    _codec_for_writing(path, style)
    check_folder(path)


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
