"""The table from suffix to codec.  A new format is one file and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from simplifier.errors import UnknownFormatError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.io import glb_writer, gltf, obj, off, ply, stl, tres
from simplifier.io.labels import Labelled
from simplifier.io.objects import Objects
from simplifier.io.polygons import IndexArray


@dataclass(frozen=True)
class Codec:
    """How files of one format are read and written.

    ``decode``       (content, path) to vertices (n, 3) float64 and faces (m, 3) int64, in the order
                     of the file, nothing merged; raises only ``OccluderError``.  The path is for
                     messages and for files that stand beside it.
    ``encode``       an occluder to bytes, the same ones every time; None when only read.
    ``error_bound``  (content, path) to the bound that ``encode`` stored, infinite when there is
                     none; None when the format has no place for it.
    ``objects``      (content, path, whether what can be seen through is taken) to the objects of
                     the file, nothing checked; None for a format whose files are one object each.
    ``external``     (content, path) to the names of the other files that the file refers to; None
                     for a format that can do without other files.
    ``labelled``     (content, path, whether other files may be opened) to what ``decode`` gives,
                     with the names of its parts; None for a format that has no names.
    """

    name: str
    decode: Callable[[bytes, Path], tuple[FloatArray, IndexArray]]
    encode: Callable[[Occluder], bytes] | None = None
    error_bound: Callable[[bytes, Path], float] | None = None
    objects: Callable[[bytes, Path, bool], Objects] | None = None
    external: Callable[[bytes, Path], list[str]] | None = None
    labelled: Callable[[bytes, Path, bool], Labelled] | None = None


CODECS: dict[str, Codec] = {
    ".glb": Codec(
        "binary glTF",
        gltf.decode,
        glb_writer.encode,
        gltf.error_bound,
        gltf.objects,
        gltf.external,
        gltf.labelled,
    ),
    ".gltf": Codec(
        "glTF", gltf.decode, None, gltf.error_bound, gltf.objects, gltf.external, gltf.labelled
    ),
    ".obj": Codec("Wavefront OBJ", obj.decode, obj.encode, labelled=obj.labelled),
    ".off": Codec("Object File Format", off.decode, off.encode),
    ".ply": Codec("Stanford PLY", ply.decode, ply.encode),
    ".stl": Codec("STL", stl.decode, stl.encode),
    ".tres": Codec("Godot occluder", tres.decode, tres.encode),
}


def readable_suffixes() -> tuple[str, ...]:
    """In alphabetical order, with the dot, in lower case."""
    return tuple(sorted(CODECS))


def writable_suffixes() -> tuple[str, ...]:
    """In alphabetical order, with the dot, in lower case."""
    return tuple(suffix for suffix in sorted(CODECS) if CODECS[suffix].encode)


def codec_for_reading(path: Path) -> Codec:
    """Raises :class:`UnknownFormatError`, which lists the suffixes that can be read."""
    codec = CODECS.get(path.suffix.lower())
    if codec is None:
        raise UnknownFormatError(
            f"files that end in '{path.suffix}' cannot be read"
            if path.suffix
            else "the file name has no suffix, so its format is unknown",
            where=str(path),
            remedy=f"use one of {' '.join(readable_suffixes())}",
        )
    return codec
