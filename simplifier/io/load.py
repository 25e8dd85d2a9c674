"""Files to meshes and occluders.

What a file is by its first bytes, to name the mistake when that is not what its suffix says.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

from simplifier.checks import as_path, check_flag, check_kind, check_one_of
from simplifier.errors import (
    EmptyMeshError,
    OccluderError,
    UnknownFormatError,
    UnreadableMeshError,
)
from simplifier.geometry.mesh import FloatArray, IndexArray, Omitted, TriangleMesh
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.geometry.overrides import ALL_OPAQUE, Ignore
from simplifier.io.claim import Claim, Peek
from simplifier.io.files import read_bytes
from simplifier.io.formats import Codec, codec_for_reading
from simplifier.io.labels import Label, Labelled, opaque_faces, sieve
from simplifier.io.objects import Objects
from simplifier.io.places import is_file
from simplifier.memory.limit import check_need
from simplifier.memory.runs import loading
from simplifier.options.simplify import Transparent


def load(
    path: str | Path,
    *,
    allow_external: bool = True,
    transparent: Transparent = "leave-out",
    ignore: Ignore = ALL_OPAQUE,
    memory_limit: float | None = None,
) -> TriangleMesh:
    """All meshes of a file as one triangle soup, in the order of the file, nothing merged.

    glTF node transforms are applied in float64.  Raises :class:`UnknownFormatError` for a suffix
    that is not in ``readable_suffixes()``, :class:`UnreadableMeshError` for a file that is missing,
    damaged or something else than its suffix says, :class:`EmptyMeshError` when it has no triangle.

    ``allow_external``  whether a glTF file may keep its buffers in files beside it; if not, a file
                        that names others is refused as unreadable, and no other is opened; an
                        OBJ file is read without its materials.
    ``transparent``     what becomes of triangles that one can see through, which must hide nothing:
                        ``leave-out``, or ``keep``.  They are those of glTF materials with an
                        alphaMode of BLEND or MASK or with transmission, and of MTL materials with
                        ``d`` below 1, ``Tr`` between 0 and 1, or ``map_d``.
    ``ignore``          what else is left out, by its names.  ``omitted`` of the result tells of
                        both.  Raises :class:`~simplifier.errors.OverridesError` for a pattern that
                        matches nothing of the file, and :class:`EmptyMeshError` where nothing is
                        left.
    ``memory_limit``    GiB that reading may need, half of the machine's by default: beyond, the
                        file is refused before it is read, by :class:`MemoryLimitError`.
    """
    path = as_path("path", path)
    check_one_of("transparent", transparent, get_args(Transparent))
    check_kind("ignore", ignore, Ignore, "the ignore of what simplifier.load_overrides returns")
    if transparent == "keep":
        ignore = replace(ignore, see_through=False)
    vertices, faces, omitted, objects = _sieve_file(path, allow_external, memory_limit, ignore)
    mesh = TriangleMesh.from_soup(vertices, faces, where=str(path))
    return replace(mesh, omitted=omitted, objects=objects)


def claim_of(path: Path) -> Claim:
    """What a mesh file says that it holds, none of it read; nothing for what reading will refuse.

    Raises :class:`UnknownFormatError` as :func:`load`.
    """
    codec = codec_for_reading(path)
    # Reading says better what is wrong with a file.
    with suppress(OSError, ValueError, LookupError, OccluderError):
        if is_file(path):
            return codec.claim(Peek(path, path.stat().st_size))
    return Claim(0, 0, 0)


def load_occluder(
    path: str | Path, *, allow_external: bool = True, memory_limit: float | None = None
) -> Occluder:
    """An occluder written by ``save_occluder``, or any other mesh to be used as one.

    The error bound is read back from GLB and OCC; elsewhere it is infinite.  A file without a
    triangle of non-zero area is an occluder that hides nothing, with 0 faces.  Unused vertices and
    triangles without area are dropped.  ``allow_external``, ``memory_limit`` and errors as for
    :func:`load`, but for the empty mesh.
    """
    path = as_path("path", path)
    _, data = _open(path, allow_external, memory_limit)
    return decode_occluder(data, path)


def decode_occluder(data: bytes, path: Path) -> Occluder:
    """As :func:`load_occluder`, of bytes whose beginning and claims need no look; ``path`` says
    their format.
    """
    codec = codec_for_reading(path)
    vertices, faces = codec.decode(data, path)
    bound = codec.error_bound(data, path) if codec.error_bound else math.inf
    try:
        mesh = TriangleMesh.from_soup(vertices, faces, where=str(path))
    except EmptyMeshError:
        return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), bound)
    return Occluder(mesh.vertices, mesh.faces, bound)


def load_objects(
    path: Path,
    *,
    allow_external: bool = True,
    transparent: Transparent = "leave-out",
    memory_limit: float | None = None,
) -> Objects:
    """The objects of a file as it states them; one, named as the file, where it has no nodes.

    ``allow_external``, ``transparent``, ``memory_limit`` and errors as for :func:`load`,
    except for the empty mesh.
    """
    check_one_of("transparent", transparent, get_args(Transparent))
    codec, data = _open(path, allow_external, memory_limit)
    if codec.objects:
        return codec.objects(data, path, transparent == "keep")
    found = _decode_labelled(codec, data, path, allow_external)
    taken = opaque_faces(found) if transparent == "leave-out" else found.faces
    return Objects.one(path.stem, (found.vertices, taken), len(found.faces) - len(taken))


def load_lods(path: str | Path) -> LodChain:
    """The levels of detail of a ``.glb`` or ``.occ`` that ``save_lods`` wrote, finest first.

    Raises :class:`UnknownFormatError` for another suffix, and :class:`UnreadableMeshError` as
    :func:`load` and when there are no levels or they are damaged.
    """
    path = as_path("path", path)
    decode = codec_for_reading(path).decode_lods
    if decode is None:
        raise UnknownFormatError(
            f"files that end in '{path.suffix}' hold no levels of detail",
            where=str(path),
            remedy="use the .glb or .occ file, or load a level's own file as an occluder",
        )
    return decode(_open(path, True, None)[1], path)


def _sieve_file(
    path: Path, allow_external: bool, memory_limit: float | None, ignore: Ignore
) -> tuple[FloatArray, IndexArray, tuple[Omitted, ...], int]:
    """The triangles of a file as it states them, less some, and of how many objects they are; its
    bytes are gone by then."""
    codec, data = _open(path, allow_external, memory_limit)
    found = _decode_labelled(codec, data, path, allow_external)
    objects = len({label.objects for label in found.labels}) if codec.objects else 1
    return *sieve(found, ignore, str(path)), objects


def _decode_labelled(codec: Codec, data: bytes, path: Path, allow_external: bool) -> Labelled:
    if codec.labelled is not None:
        return codec.labelled(data, path, allow_external)
    vertices, faces = codec.decode(data, path)
    return Labelled(vertices, faces, [Label()], [len(faces)])


def _open(path: Path, allow_external: bool, memory_limit: float | None) -> tuple[Codec, bytes]:
    """The codec of the suffix and the content, which must not begin like another format."""
    check_flag("allow_external", allow_external)
    codec = codec_for_reading(path)

    def check_start(start: bytes, size: int) -> None:
        found = foreign_content(start, path.suffix.lower())
        if found:
            raise UnreadableMeshError(
                f"the suffix says {codec.name}, but this is {found}",
                where=str(path),
                remedy="give the file its right suffix, or export it again",
            )
        if codec.check_start:
            codec.check_start(start, size, str(path))
        claim = claim_of(path)
        need = loading(claim.vertices, claim.triangles, claim.decoding)
        check_need(need, memory_limit, where=str(path))

    data = read_bytes(path, check_start=check_start)
    if codec.external and not allow_external:
        _check_alone(codec.external(data, path), path)
    return codec, data


def _check_alone(uris: list[str], path: Path) -> None:
    if uris:
        raise UnreadableMeshError(
            f"refers to another file, '{uris[0][:60]}', and only files that hold all of their data"
            " are read here",
            where=str(path),
            remedy="export a single .glb",
        )


# (pattern at the start of the file, what that is, suffixes of the formats that may begin so)
_SIGNATURES: tuple[tuple[re.Pattern[bytes], str, tuple[str, ...]], ...] = tuple(
    (re.compile(pattern, re.DOTALL), name, suffixes)
    for pattern, name, suffixes in (
        (rb"glTF", "a binary glTF (GLB) file", (".glb", ".gltf")),
        (rb"\x89OCC\r\n\x1a\n", "an occluder file (.occ)", (".occ",)),
        (rb"ply[ \t]*[\r\n]", "a PLY file", (".ply",)),
        (rb"(\xef\xbb\xbf)?\s*\[gd_(resource|scene)\b", "a Godot text resource", (".tres",)),
        (rb"(\xef\xbb\xbf)?\s*\{.{0,4096}\"asset\"", "a glTF (JSON) file", (".gltf", ".glb")),
        (rb"(ST)?C?N?4?n?OFF\s", "an OFF file", (".off",)),
        (rb"solid\b[^\r\n]*[\r\n]+\s*facet\b", "a text STL file", (".stl",)),
        (rb"PK\x03\x04", "a ZIP archive (3MF, USDZ, …)", (".3mf",)),
        (rb"\x1f\x8b", "a gzip archive", ()),
        (rb"Kaydara FBX Binary", "a binary FBX file", ()),
        (rb"BLENDER", "a Blender file", ()),
        (rb"#usda|PXR-USDC", "a USD file", ()),
        (rb"\x89PNG|\xff\xd8\xff", "a picture", ()),
        (rb"\xff\xfe|\xfe\xff", "UTF-16 or UTF-32 text (save it as UTF-8)", ()),
        # Without a mark: every other byte of plain letters is 0.  A binary STL may begin so.
        (rb"([\t\n\r -~]\0){8}|(\0[\t\n\r -~]){8}", "UTF-16 text (save it as UTF-8)", (".stl",)),
        (rb"version https://git-lfs", "a Git LFS pointer (run 'git lfs pull')", ()),
        (rb"(?i)\s*<(!doctype )?html\b", "a web page", ()),
        (rb"(\xef\xbb\xbf)?\s*<\?xml", "an XML file (COLLADA, X3D, …)", (".dae",)),
    )
)


def foreign_content(data: bytes, suffix: str) -> str:
    """What the file is, when that is certain and not what ``suffix`` says; else an empty string."""
    head = data[:8192]
    for pattern, name, suffixes in _SIGNATURES:
        if pattern.match(head):
            return "" if suffix in suffixes else name
    return ""
