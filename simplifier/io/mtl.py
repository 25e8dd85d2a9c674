"""Which materials of a Wavefront OBJ file one can see through, from the MTL files beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from simplifier.errors import MeshError
from simplifier.io.source import read_bytes
from simplifier.io.text import named_lines

_PARTS = re.compile(r"[/\\]")


def see_through_materials(libraries: list[str], mesh: Path) -> set[str]:
    """The names of materials with ``d`` below 1, ``Tr`` above 0 or a ``map_d``.

    ``libraries``  what ``mtllib`` statements of ``mesh`` say: a name, or several.  Only files under
    the mesh's folder are opened; one that is not there, or cannot be read, says nothing: OBJ files
    are often passed on without it.
    """
    found: set[str] = set()
    for said in dict.fromkeys(libraries):
        for path in _files(said, mesh.parent.resolve()):
            try:
                found |= _see_through(read_bytes(path))
            except MeshError:
                continue
    return found


def library_files(libraries: list[str], mesh: Path) -> list[str]:
    """What is looked for to that end, there or not: names relative to the mesh's folder."""
    folder = mesh.parent.resolve()
    names = dict.fromkeys(name for said in libraries for name in (said, *said.split()))
    paths = dict.fromkeys(_beside(name, folder) for name in names)
    return [path.relative_to(folder).as_posix() for path in paths if path not in (None, folder)]


def _files(said: str, folder: Path) -> Iterator[Path]:
    """One name, which may hold blanks, or else several."""
    whole = _beside(said, folder)
    if whole is not None and whole.is_file():
        yield whole
        return
    for name in said.split():
        path = _beside(name, folder)
        if path is not None:
            yield path


def _beside(name: str, folder: Path) -> Path | None:
    """None for what leads out of the folder: a mesh from elsewhere must not have others read."""
    try:
        path = folder.joinpath(*_PARTS.split(name)).resolve()
    except (OSError, ValueError, RuntimeError):  # a NUL character, a loop of links
        return None
    return path if path.is_relative_to(folder) else None


def _see_through(data: bytes) -> set[str]:
    found: set[str] = set()
    material = ""
    for _, keyword, rest in named_lines(data, (b"newmtl", b"d", b"Tr", b"map_d")):
        match keyword:
            case b"newmtl":
                material = rest
            case b"map_d":
                found.add(material)
            case b"d":
                found |= {material} if _last_number(rest, 1.0) < 1.0 else set()
            case _:
                found |= {material} if _last_number(rest, 0.0) > 0.0 else set()
    return found


def _last_number(text: str, otherwise: float) -> float:
    """``-halo 0.5`` is 0.5; what is no number counts as ``otherwise``."""
    try:
        return float(text.split()[-1])
    except (ValueError, IndexError):
        return otherwise
