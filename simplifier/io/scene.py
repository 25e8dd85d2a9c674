"""A scene from a glTF file, from a folder of meshes, or from one mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from simplifier.checks import as_path, check_flag
from simplifier.errors import EmptyMeshError
from simplifier.geometry.scene import Scene
from simplifier.io.folder import objects_of_folder, unused_overrides
from simplifier.io.formats import readable_suffixes
from simplifier.io.load import load_objects
from simplifier.io.usable import usable_scene
from simplifier.options import Transparent


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
    if not path.is_dir():
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
