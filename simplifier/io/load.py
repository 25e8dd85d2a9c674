"""Files to meshes and occluders."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.checks import check_one_of
from simplifier.errors import EmptyMeshError, UnknownFormatError, UnreadableMeshError
from simplifier.geometry.lod_chain import LodChain
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import ALL_OPAQUE, Ignore
from simplifier.io.formats import Codec, codec_for_reading
from simplifier.io.gltf_lods import decode_lods
from simplifier.io.labels import Label, Labelled, opaque_faces, sieved
from simplifier.io.objects import Objects
from simplifier.io.sniff import foreign_content
from simplifier.io.source import read_bytes
from simplifier.options import Transparent


def load_mesh(
    path: str | Path,
    *,
    allow_external: bool = True,
    transparent: Transparent = "leave-out",
    ignore: Ignore = ALL_OPAQUE,
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
                        ``d`` below 1, ``Tr`` above 0 or ``map_d``.
    ``ignore``          what else is left out, by its names.  ``omitted`` of the result tells of
                        both.  Raises :class:`~simplifier.errors.OverridesError` for a pattern that
                        matches nothing of the file, and :class:`EmptyMeshError` where nothing is
                        left.
    """
    path = Path(path)
    check_one_of("transparent", transparent, ("leave-out", "keep"))
    if transparent == "keep":
        ignore = replace(ignore, see_through=False)
    codec, data = _open(path, allow_external)
    found = _labelled(codec, data, path, allow_external)
    vertices, faces, omitted = sieved(found, ignore, str(path))
    return replace(TriangleMesh.from_soup(vertices, faces, where=str(path)), omitted=omitted)


def _labelled(codec: Codec, data: bytes, path: Path, allow_external: bool) -> Labelled:
    if codec.labelled is not None:
        return codec.labelled(data, path, allow_external)
    vertices, faces = codec.decode(data, path)
    return Labelled(vertices, faces, [Label()], [len(faces)])


def load_occluder(path: str | Path, *, allow_external: bool = True) -> Occluder:
    """An occluder written by ``save_occluder``, or any other mesh to be used as one.

    The error bound is read back from GLB; elsewhere it is infinite.  A file without a triangle of
    non-zero area is an occluder that hides nothing, with 0 faces.  Unused vertices and triangles
    without area are dropped.  ``allow_external`` and errors as for :func:`load_mesh`, but for the
    empty mesh.
    """
    path = Path(path)
    codec, data = _open(path, allow_external)
    vertices, faces = codec.decode(data, path)
    bound = codec.error_bound(data, path) if codec.error_bound else math.inf
    try:
        mesh = TriangleMesh.from_soup(vertices, faces, where=str(path))
    except EmptyMeshError:
        return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), bound)
    return Occluder(mesh.vertices, mesh.faces, bound)


def load_objects(
    path: Path, *, allow_external: bool = True, transparent: Transparent = "leave-out"
) -> Objects:
    """The objects of a file as it states them; one, named as the file, where it has no nodes.

    ``allow_external``, ``transparent`` and errors as for :func:`load_mesh`, except for the empty
    mesh.
    """
    check_one_of("transparent", transparent, ("leave-out", "keep"))
    codec, data = _open(path, allow_external)
    if codec.objects:
        return codec.objects(data, path, transparent == "keep")
    found = _labelled(codec, data, path, allow_external)
    taken = opaque_faces(found) if transparent == "leave-out" else found.faces
    return Objects.one(path.stem, (found.vertices, taken), len(found.faces) - len(taken))


def load_lods(path: str | Path) -> LodChain:
    """The levels of detail of a ``.glb`` that ``save_lods`` wrote, finest first.

    Raises :class:`UnknownFormatError` for another suffix, and :class:`UnreadableMeshError` as
    :func:`load_mesh` and when there are no levels or they are damaged.
    """
    path = Path(path)
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise UnknownFormatError(
            f"files that end in '{path.suffix}' hold no levels of detail",
            where=str(path),
            remedy="use the .glb file, or load a level's own file as an occluder",
        )
    return decode_lods(_open(path, allow_external=True)[1], path)


def _open(path: Path, allow_external: bool) -> tuple[Codec, bytes]:
    """The codec of the suffix and the content, which must not begin like another format."""
    codec = codec_for_reading(path)
    data = read_bytes(path)
    found = foreign_content(data, path.suffix.lower())
    if found:
        raise UnreadableMeshError(
            f"the suffix says {codec.name}, but this is {found}",
            where=str(path),
            remedy="give the file its right suffix, or export it again",
        )
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
