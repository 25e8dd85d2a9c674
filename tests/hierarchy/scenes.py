"""Small scenes whose parts, keys and occluders are known."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.options.scene import SceneOptions
from tests.solids import box

QUICK = SceneOptions(budget=12, resolution=8, width=4, moves=20, pixel_error=100.0)
"""So coarse that inner nodes are worth an occluder in a small scene, too."""


def scene_of(meshes, mesh_of, transforms, names=None):
    names = names or [f"object {i}" for i in range(len(mesh_of))]
    return Scene(
        tuple(meshes), tuple(names), np.array(mesh_of, dtype=np.int32),
        np.array(transforms, dtype=np.float64),
    )  # fmt: skip


def moved(x=0.0, y=0.0, z=0.0, linear=None):
    """(4, 4) a translation after a linear map."""
    transform = np.eye(4)
    transform[:3, :3] = np.eye(3) if linear is None else linear
    transform[:3, 3] = x, y, z
    return transform


def turned(axis, degrees):
    """(3, 3) a rotation about x, y or z."""
    i, j = ((1, 2), (2, 0), (0, 1))["xyz".index(axis)]
    angle = np.radians(degrees)
    matrix = np.eye(3)
    matrix[[i, j], [i, j]] = np.cos(angle)
    matrix[i, j], matrix[j, i] = -np.sin(angle), np.sin(angle)
    return matrix


def fine_box(extent=(1.0, 1.0, 1.0), cuts=2, low=(0.0, 0.0, 0.0)):
    """A closed box of 12 cuts**2 triangles."""
    coarse = box(extent, low)
    corners = coarse.vertices[coarse.faces]
    for _ in range(int(np.log2(cuts))):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate(
            [
                np.stack(some, axis=1)
                for some in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
            ]
        )
    return TriangleMesh.from_soup(
        corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    )


def street(count=8, meshes=None, gap=3.0):
    """Boxes in two rows; every other one is lower.  None is cut: they have 48 triangles."""
    meshes = meshes or [fine_box((2.0, 3.0, 2.0)), fine_box((2.0, 2.0, 2.0))]
    places = [moved(gap * (i // 2), 0.0, 4.0 * (i % 2)) for i in range(count)]
    return scene_of(meshes, [i % len(meshes) for i in range(count)], places)


def reordered(scene, order):
    """The same objects in another order."""
    return Scene(
        scene.meshes, tuple(scene.names[i] for i in order), scene.mesh_of[order],
        scene.transforms[order],
    )  # fmt: skip


def with_object(scene, index, transform=None, mesh=None):
    """The scene with one object at another place, or with another mesh."""
    transforms, mesh_of = scene.transforms.copy(), scene.mesh_of.copy()
    meshes = scene.meshes
    if transform is not None:
        transforms[index] = transform
    if mesh is not None:
        meshes = (*meshes, mesh)
        mesh_of[index] = len(meshes) - 1
    return Scene(meshes, scene.names, mesh_of, transforms)
