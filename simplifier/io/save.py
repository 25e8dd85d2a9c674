"""Occluders to files, all or nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.checks import as_path, check_kind
from simplifier.errors import OutputError
from simplifier.geometry.occluder import AN_OCCLUDER, Occluder
from simplifier.io.formats import CODECS, Codec, writable_suffixes
from simplifier.io.whole import check_folder, write_whole


def save_occluder(occluder: Occluder, path: str | Path) -> None:
    """Write the occluder in the format of the suffix; every format can hold one of 0 faces.

    The file appears whole or not at all, and an old one stays until then; a link is followed.
    ``.ply``, ``.obj``, ``.off`` and ``.tres`` keep float64, ``.glb`` keeps float32 relative to the
    occluder's centre, ``.stl`` float32 in absolute coordinates.  Raises :class:`OutputError`, also
    where float32 would move a corner by more than a thousandth of the occluder's longest extent.
    """
    path = as_path("path", path)
    check_kind("occluder", occluder, Occluder, AN_OCCLUDER)
    write_whole(path, encoded(occluder, path))


def encoded(occluder: Occluder, path: Path) -> bytes:
    """What the file is to hold.  Raises :class:`OutputError`."""
    codec = _codec_for_writing(path)
    _check(occluder, path)
    try:
        return codec.encode(occluder) if codec.encode else b""
    except OutputError as error:
        raise OutputError(error.what, where=str(path), remedy=error.remedy) from None


def check_writable(path: str | Path) -> None:
    """Raise :class:`OutputError` now for what would keep an occluder from being written later."""
    path = as_path("path", path)
    _codec_for_writing(path)
    check_folder(path)


def _codec_for_writing(path: Path) -> Codec:
    codec = CODECS.get(path.suffix.lower())
    if codec is None or codec.encode is None:
        raise OutputError(
            f"files that end in '{path.suffix}' cannot be written",
            where=str(path),
            remedy=f"use one of {' '.join(writable_suffixes())}",
        )
    return codec


def _check(occluder: Occluder, path: Path) -> None:
    """What no format can hold."""
    faces = occluder.faces
    if not np.isfinite(occluder.vertices).all():
        raise OutputError("the occluder has a coordinate that is not finite", where=str(path))
    if faces.size and (faces.min() < 0 or faces.max() >= len(occluder.vertices)):
        raise OutputError("the occluder names a vertex that it does not have", where=str(path))
