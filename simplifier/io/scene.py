"""A scene from a glTF file, from a folder of meshes, or from one mesh.

The objects of all mesh files of a folder.

Objects as stated -> a scene of those that can be used, and a word on the others.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path, check_flag
from simplifier.errors import (
    EmptyMeshError,
    MemoryLimitError,
    MeshError,
    OccluderError,
    UnreadableMeshError,
)
from simplifier.geometry.mesh import DroppedTriangles, FloatArray, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.sound_meshes import sound_meshes
from simplifier.io.formats import CODECS, readable_suffixes
from simplifier.io.gltf_scene import MOST_INSTANCES
from simplifier.io.labels import KEEP
from simplifier.io.load import load_objects
from simplifier.io.objects import Objects, RawMesh, list_first, unique_names
from simplifier.io.places import is_folder
from simplifier.io.suffixes import overrides_beside
from simplifier.options.simplify import Transparent


def load_scene(
    path: str | Path,
    *,
    allow_external: bool = True,
    transparent: Transparent = "leave-out",
    memory_limit: float | None = None,
) -> Scene:
    """All objects of a file or of a folder's files, those of one mesh sharing it.

    ``.glb`` and ``.gltf``: an object for each node with a mesh, and for each instance of
    EXT_mesh_gpu_instancing.  Any other mesh file: one object.  A folder: the objects of every mesh
    file in it and in the folders under it, by path; hidden ones and links to folders are passed
    over, and a file that cannot be read becomes a warning.  Meshes that are equal to the last bit
    become one.

    Objects that cannot be used (no triangle with an area, a transform that is not finite, flattens,
    or is not affine) are left out with a warning, and repeated names are numbered with one.  Raises
    :class:`EmptyMeshError` when no object is left, :class:`UnknownFormatError` and
    :class:`UnreadableMeshError` as ``load_mesh`` does, the latter also for more than ten million
    objects; there is no limit on the triangles that instances add up to.  ``allow_external``,
    ``transparent`` and ``memory_limit`` as there, of a folder's files each; an object of which
    nothing is left is left out.  Overrides beside a file are not read, and a warning says so.
    """
    path = as_path("path", path)
    check_flag("allow_external", allow_external)
    if not is_folder(path):
        objects = load_objects(
            path, allow_external=allow_external, transparent=transparent, memory_limit=memory_limit
        )
        scene = usable_scene(objects, str(path))
        return replace(scene, warnings=(*unused_overrides([path]), *scene.warnings))
    objects, warnings = objects_of_folder(
        path, allow_external=allow_external, transparent=transparent, memory_limit=memory_limit
    )
    if not objects.names:
        raise EmptyMeshError(
            warnings[0] if warnings else "the folder holds no mesh file",
            where=str(path),
            remedy=f"put files there that end in one of {' '.join(readable_suffixes())}",
        )
    scene = usable_scene(objects, str(path))
    return replace(scene, warnings=(*warnings, *scene.warnings))


def objects_of_folder(
    folder: Path, *, allow_external: bool, transparent: Transparent, memory_limit: float | None
) -> tuple[Objects, list[str]]:
    """The objects, by relative path and then as in the file, and what could not be read.

    A file's object is named by its relative path without the suffix, and the objects of a glTF file
    "path/name".  Raises :class:`UnreadableMeshError` for more than ``MOST_INSTANCES`` objects
    and :class:`MemoryLimitError`.
    """
    files, warnings = _mesh_files(folder)
    found: list[Objects] = []
    count = 0
    for path in files:
        name = path.relative_to(folder).with_suffix("").as_posix()
        try:
            objects = load_objects(
                path,
                allow_external=allow_external,
                transparent=transparent,
                memory_limit=memory_limit,
            )
        except MemoryLimitError:
            raise  # leaving it out would make another scene
        except OccluderError as error:
            warnings.append(f"{error} (the file was left out)")
            continue
        many = CODECS[path.suffix.lower()].objects is not None
        names = [f"{name}/{own}" for own in objects.names] if many else [name]
        found.append(replace(objects, names=names))
        count += len(names)
        if count > MOST_INSTANCES:
            raise UnreadableMeshError(
                f"its files have more than {MOST_INSTANCES} objects",
                where=str(folder),
                remedy="split the scene",
            )
    return Objects.joined(found), [*warnings, *unused_overrides(files)]


def files_of(path: Path) -> list[Path]:
    """The mesh files that a scene is read from: itself, or those of a folder."""
    return _mesh_files(path)[0] if is_folder(path) else [path]


def unused_overrides(meshes: Sequence[Path]) -> list[str]:
    """A warning where meshes have overrides: a scene would have to carry them into every node."""
    found = [beside for beside in dict.fromkeys(map(overrides_beside, meshes)) if beside]
    if not found:
        return []
    others = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return [f"{found[0]}{others}: overrides are for single meshes; a scene takes none"]


def _mesh_files(folder: Path) -> tuple[list[Path], list[str]]:
    """Files with a suffix that can be read, by path, and the folders that cannot be entered."""
    files: list[Path] = []
    warnings: list[str] = []

    def closed(error: OSError) -> None:
        warnings.append(
            f"{error.filename}: the folder cannot be read ({error.strerror}); check its permissions"
        )

    for place, folders, names in os.walk(folder, onerror=closed):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [
            Path(place, name)
            for name in names
            if not name.startswith(".") and Path(name).suffix.lower() in CODECS
        ]
    return sorted(files, key=lambda path: path.relative_to(folder).parts), warnings


_FLAT = 1e-12  # of the largest stretch: what is inverted below this keeps three digits at most
_FURTHEST = 1e100  # as for the vertices of a mesh
_NO_TRIANGLE = (
    "no triangle with a finite, non-zero area; export with faces, or take it off the scene"
)
_SEE_THROUGH = f"all of it is see-through; {KEEP}"
_OCCLUDER = (
    "an occluder already, as its name ends in '-occonly'; rename its node if it is to be shown"
)
_NOT_FINITE = "a transform that is not finite; repair the matrix or scale of its node or parents"
_NOT_AFFINE = "a matrix whose last row is not 0 0 0 1; take the projection out of its node"
_FLATTENED = "a transform that flattens it; give its node a scale that is not 0 on any axis"
_FAR = "points too far out for 64-bit numbers; repair the scale of its node or parents"


def usable_scene(objects: Objects, where: str) -> Scene:
    """Equal meshes become one, names unique, and what cannot be used becomes a warning.

    Raises :class:`EmptyMeshError` when no object is left.
    """
    names, warnings = unique_names(objects.names)
    different, shared = _share_meshes(objects.meshes)
    meshes, mesh_faults = _check_meshes([objects.meshes[place] for place in different])
    mesh_of = shared[objects.mesh_of]
    faults = _faults(mesh_of, meshes, mesh_faults, objects.transforms)
    see_through = np.array(objects.see_through, dtype=np.int64)[objects.mesh_of]
    for place in np.nonzero(see_through)[0].tolist():
        if faults[place] == _NO_TRIANGLE:
            faults[place] = _SEE_THROUGH
    for place in np.nonzero(objects.occluders)[0].tolist():
        faults[place] = _OCCLUDER
    left_out = _omission_warnings(names, faults)
    warnings += left_out
    good = np.array([not fault for fault in faults], dtype=np.bool_)
    if not good.any():
        raise EmptyMeshError(
            left_out[0] if names else "there is no object with a mesh",
            where=where,
            remedy="repair one at least" if names else "export it with meshes",
        )
    used, places = np.unique(mesh_of[good], return_inverse=True)
    kept = tuple(mesh for mesh in (meshes[place] for place in used.tolist()) if mesh)
    kept_names = tuple(name for name, keep in zip(names, good.tolist(), strict=True) if keep)
    kept_mesh_of = places.reshape(-1).astype(np.int32)
    warnings += _in_part(objects, good, names)
    warnings += _dropped_warnings(kept, kept_mesh_of, kept_names)
    return Scene(
        kept, kept_names, kept_mesh_of, objects.transforms[good], tuple(warnings),
        int(see_through.sum()),
    )  # fmt: skip


def _share_meshes(meshes: Sequence[RawMesh]) -> tuple[list[int], NDArray[np.int64]]:
    """Places of the meshes that differ, and which of those each mesh is."""
    first: dict[bytes, int] = {}
    places: list[int] = []
    shared = np.empty(len(meshes), dtype=np.int64)
    for place, mesh in enumerate(meshes):
        content = hashlib.blake2b(repr([part.shape for part in mesh]).encode())
        for part in mesh:
            content.update(np.ascontiguousarray(part).data)
        key = content.digest()
        if key not in first:
            first[key] = len(places)
            places.append(place)
        shared[place] = first[key]
    return places, shared


def _check_meshes(meshes: Sequence[RawMesh]) -> tuple[list[TriangleMesh | None], list[str]]:
    """The meshes, None for one that cannot be used, and why not, empty for one that can."""
    checked, faults = sound_meshes(meshes), [""] * len(meshes)
    for place in (place for place, mesh in enumerate(checked) if mesh is None):
        try:
            checked[place] = TriangleMesh.from_soup(*meshes[place])
        except EmptyMeshError:
            faults[place] = _NO_TRIANGLE
        except MeshError as error:
            faults[place] = f"a damaged mesh ({error.what}); {error.remedy}"
    return checked, faults


def _faults(
    mesh_of: NDArray[np.int64],
    meshes: Sequence[TriangleMesh | None],
    mesh_faults: Sequence[str],
    transforms: FloatArray,
) -> list[str]:
    """What is wrong with each object, the first that applies; empty for a good one."""
    furthest = np.array([np.abs(mesh.vertices).max() if mesh else 0.0 for mesh in meshes])
    linear = transforms[:, :3, :3]
    finite = np.asarray(np.isfinite(transforms).all(axis=(1, 2)))
    affine = np.asarray((transforms[:, 3] == [0.0, 0.0, 0.0, 1.0]).all(axis=1))
    with np.errstate(invalid="ignore", over="ignore"):
        stretch = np.linalg.svd(np.where(finite[:, None, None], linear, 0.0), compute_uv=False)
        reach = np.abs(linear).sum(axis=2) * furthest[mesh_of, None] + np.abs(transforms[:, :3, 3])
    tests = (
        (_NOT_FINITE, ~finite),
        (_NOT_AFFINE, ~affine),
        (_FLATTENED, stretch[:, 2] <= _FLAT * stretch[:, 0]),
        (_FAR, ~(reach < _FURTHEST).all(axis=1)),
    )
    faults = [mesh_faults[mesh] for mesh in mesh_of.tolist()]
    for fault, applies in tests:
        for place in np.nonzero(applies)[0].tolist():
            faults[place] = faults[place] or fault
    return faults


def _omission_warnings(names: Sequence[str], faults: Sequence[str]) -> list[str]:
    """One warning a fault, with the objects that have it."""
    by_fault: dict[str, list[str]] = {}
    for name, fault in zip(names, faults, strict=True):
        if fault:
            by_fault.setdefault(fault, []).append(f"'{name}'")
    return [
        f"object{'s' if len(group) > 1 else ''} {list_first(group)} left out: {fault}"
        for fault, group in by_fault.items()
    ]


def _in_part(objects: Objects, good: NDArray[np.bool_], names: Sequence[str]) -> list[str]:
    """One warning for what one can see through of objects that are there otherwise."""
    counts = np.array(objects.see_through, dtype=np.int64)
    places = np.nonzero(good & (counts[objects.mesh_of] > 0))[0]
    if len(places) == 0:
        return []
    total = int(counts[np.unique(objects.mesh_of[places])].sum())
    noun = "triangle" if total == 1 else "triangles"
    quoted = list_first([f"'{names[place]}'" for place in places.tolist()])
    return [f"{total} see-through {noun} left out of {quoted}; {KEEP}"]


def _dropped_warnings(
    meshes: Sequence[TriangleMesh], mesh_of: NDArray[np.int32], names: Sequence[str]
) -> list[str]:
    """One warning for all triangles that meshes lost; those of a shared mesh count once."""
    lossy = np.array([mesh.dropped.total > 0 for mesh in meshes])
    if not lossy.any():
        return []
    total = sum((mesh.dropped for mesh in meshes), DroppedTriangles())
    first = names[int(np.nonzero(lossy[mesh_of])[0][0])]
    return [
        f"{total.total} unusable {'triangle' if total.total == 1 else 'triangles'} left out"
        f" ({total}), the first in object '{first}'; check the export"
    ]
