"""The table from suffix to codec.  A new format is one file, a function here and a line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from simplifier.errors import UnknownFormatError
from simplifier.geometry.mesh import FloatArray, IndexArray, IntArray
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.io.claim import Claim, Peek
from simplifier.io.labels import Labelled
from simplifier.io.objects import Objects
from simplifier.io.places import is_folder
from simplifier.io.suffixes import OCCLUDER_SUFFIXES, QUAD_SUFFIXES


@dataclass(frozen=True)
class Codec:
    """How files of one format are read and written.

    ``decode``       (content, path) to vertices (n, 3) float64 and faces (m, 3) int64, in the order
                     of the file, nothing merged; raises only ``OccluderError``.  The path is for
                     messages and for files that stand beside it.
    ``claim``        what a file says that it holds, from parts of it; raises OSError and
                     ``OccluderError``.
    ``encode``       an occluder to bytes, the same ones every time; None when only read.
    ``encode_polygons``  the same with quads and triangles in place of its faces; None where the
                     format has no quads.
    ``encode_lods``  a chain of levels to bytes, and
    ``decode_lods``  (content, path) back to one; None where the format has no place for it.
    ``error_bound``  (content, path) to the bound that ``encode`` stored, infinite when there is
                     none; None when the format has no place for it.
    ``objects``      (content, path, whether what can be seen through is taken) to the objects of
                     the file, nothing checked; None for a format whose files are one object each.
    ``external``     (content, path) to the names of the other files that the file refers to; None
                     for a format that can do without other files.
    ``consulted``    (content, path) to the names of files beside it that ``labelled`` looks at if
                     they are there; None for a format that has no such.
    ``labelled``     (content, path, whether other files may be opened) to what ``decode`` gives,
                     with the names of its parts; None for a format that has no names.
    ``check_start``  (first 64 KiB, size of the file, name for messages): raises what ``decode``
                     would for a file that cannot be of this format, however it goes on;
                     None where nothing can be said by then.
    """

    name: str
    decode: Callable[[bytes, Path], tuple[FloatArray, IndexArray]]
    claim: Callable[[Peek], Claim]
    encode: Callable[[Occluder], bytes] | None = None
    encode_polygons: Callable[[Occluder, IntArray, IntArray], bytes] | None = None
    encode_lods: Callable[[LodChain], bytes] | None = None
    decode_lods: Callable[[bytes, Path], LodChain] | None = None
    error_bound: Callable[[bytes, Path], float] | None = None
    objects: Callable[[bytes, Path, bool], Objects] | None = None
    external: Callable[[bytes, Path], list[str]] | None = None
    consulted: Callable[[bytes, Path], list[str]] | None = None
    labelled: Callable[[bytes, Path, bool], Labelled] | None = None
    check_start: Callable[[bytes, int, str], None] | None = None


def _threemf() -> Codec:
    from simplifier.io import threemf

    return Codec(
        "3MF",
        threemf.decode,
        threemf.claim,
        objects=threemf.objects,
        labelled=threemf.decode_labelled,
        check_start=threemf.check_start,
    )


def _dae() -> Codec:
    from simplifier.io import collada, collada_claim

    return Codec(
        "COLLADA",
        collada.decode,
        collada_claim.claim,
        objects=collada.objects,
        labelled=collada.decode_labelled,
        check_start=collada.check_start,
    )


def _glb() -> Codec:
    from simplifier.io import glb_writer, gltf, gltf_lods
    from simplifier.io.gltf_container import check_container

    return Codec(
        "binary glTF",
        gltf.decode,
        gltf.claim,
        glb_writer.encode,
        encode_lods=glb_writer.encode_lods,
        decode_lods=gltf_lods.decode_lods,
        error_bound=gltf.error_bound,
        objects=gltf.objects,
        external=gltf.external,
        labelled=gltf.decode_labelled,
        check_start=check_container,
    )


def _gltf() -> Codec:
    from simplifier.io import gltf, gltf_lods
    from simplifier.io.gltf_container import check_container

    return Codec(
        "glTF",
        gltf.decode,
        gltf.claim,
        decode_lods=gltf_lods.decode_lods,
        error_bound=gltf.error_bound,
        objects=gltf.objects,
        external=gltf.external,
        labelled=gltf.decode_labelled,
        check_start=check_container,
    )


def _obj() -> Codec:
    from simplifier.io import obj

    return Codec(
        "Wavefront OBJ",
        obj.decode,
        obj.claim,
        obj.encode,
        encode_polygons=obj.encode,
        consulted=obj.material_files,
        labelled=obj.decode_labelled,
        check_start=obj.check_start,
    )


def _occ() -> Codec:
    from simplifier.io import occ

    return Codec(
        "occluder file",
        occ.decode,
        occ.claim,
        occ.encode,
        encode_lods=occ.encode_lods,
        decode_lods=occ.decode_lods,
        error_bound=occ.error_bound,
        check_start=occ.check_start,
    )


def _off() -> Codec:
    from simplifier.io import off

    return Codec(
        "Object File Format",
        off.decode,
        off.claim,
        off.encode,
        encode_polygons=off.encode,
        check_start=off.check_start,
    )


def _ply() -> Codec:
    from simplifier.io import ply

    return Codec(
        "Stanford PLY",
        ply.decode,
        ply.claim,
        ply.encode,
        encode_polygons=ply.encode,
        check_start=ply.check_start,
    )


def _stl() -> Codec:
    from simplifier.io import stl

    return Codec("STL", stl.decode, stl.claim, stl.encode, check_start=stl.check_start)


def _tres() -> Codec:
    from simplifier.io import tres

    return Codec(
        "Godot occluder", tres.decode, tres.claim, tres.encode, check_start=tres.check_start
    )


_CODECS: Mapping[str, Callable[[], Codec]] = {
    ".3mf": _threemf, ".dae": _dae, ".glb": _glb, ".gltf": _gltf, ".obj": _obj, ".occ": _occ,
    ".off": _off, ".ply": _ply, ".stl": _stl, ".tres": _tres,
}  # fmt: skip


class _Codecs(Mapping[str, Codec]):
    """Codecs by suffix, each loaded when it is looked up: a run needs one or two of them."""

    def __getitem__(self, suffix: str) -> Codec:
        return _codec(suffix)

    def __contains__(self, suffix: object) -> bool:
        return suffix in _CODECS

    def __iter__(self) -> Iterator[str]:
        return iter(_CODECS)

    def __len__(self) -> int:
        return len(_CODECS)


@cache
def _codec(suffix: str) -> Codec:
    return _CODECS[suffix]()


CODECS: Mapping[str, Codec] = _Codecs()


def readable_suffixes() -> tuple[str, ...]:
    """In alphabetical order, with the dot, in lower case."""
    return tuple(sorted(CODECS))


def writable_suffixes() -> tuple[str, ...]:
    """In alphabetical order, with the dot, in lower case."""
    return OCCLUDER_SUFFIXES


def suffixes_with_quads() -> tuple[str, ...]:
    """Of formats that can hold quads, in alphabetical order."""
    return QUAD_SUFFIXES


def codec_for_reading(path: Path) -> Codec:
    """Raises :class:`UnknownFormatError`, which lists the suffixes that can be read."""
    codec = CODECS.get(path.suffix.lower())
    if codec is None:
        if is_folder(path):
            raise UnknownFormatError("this is a folder", where=str(path), remedy="name a mesh file")
        raise UnknownFormatError(
            f"files that end in '{path.suffix}' cannot be read"
            if path.suffix
            else "the file name has no suffix, so its format is unknown",
            where=str(path),
            remedy=f"use one of {' '.join(readable_suffixes())}",
        )
    return codec
