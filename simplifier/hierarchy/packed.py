"""A scene as files that several processes map into memory, so that none holds a copy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene

_ARRAYS = ("vertices", "faces", "vertex_ends", "face_ends", "mesh_of", "transforms")


def pack(scene: Scene, folder: Path) -> None:
    """Write the geometry, without names and warnings.  Raises :class:`OutputError`."""
    arrays: tuple[NDArray[Any], ...] = (
        np.concatenate([mesh.vertices for mesh in scene.meshes]),
        np.concatenate([mesh.faces for mesh in scene.meshes]),
        np.cumsum([len(mesh.vertices) for mesh in scene.meshes]),
        np.cumsum([len(mesh.faces) for mesh in scene.meshes]),
        scene.mesh_of,
        scene.transforms,
    )
    try:
        for name, array in zip(_ARRAYS, arrays, strict=True):
            np.save(folder / f"{name}.npy", array)
    except OSError as error:
        raise OutputError(
            f"the scene cannot be handed to other processes ({error.strerror})",
            where=str(folder),
            remedy="free some space, set TMPDIR to another folder, or OCCLUDER_THREADS=1",
        ) from None


def unpack(folder: Path) -> Scene:
    """The geometry, read from the files when it is looked at; names are empty."""
    vertices, faces, vertex_ends, face_ends, mesh_of, transforms = (
        np.asarray(np.load(folder / f"{name}.npy", mmap_mode="r")) for name in _ARRAYS
    )
    meshes = [
        TriangleMesh(*pair)
        for pair in zip(
            np.split(vertices, vertex_ends[:-1]), np.split(faces, face_ends[:-1]), strict=True
        )
    ]
    return Scene(tuple(meshes), ("",) * len(mesh_of), mesh_of, transforms)
