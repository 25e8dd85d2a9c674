"""Small scenes that can be walked through, z up, metres; and the same ones elsewhere."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from tests.segments import crossings
from tests.solids import box

TO_UP = {"x": (2, 0, 1), "y": (1, 2, 0), "z": (0, 1, 2)}
"""Which of the axes x, y, z of a z-up scene each world axis takes."""


def scene_of(*meshes, names=None):
    """Each mesh an object of its own, where it stands."""
    count = len(meshes)
    return Scene(
        tuple(meshes), tuple(names or (f"object {i}" for i in range(count))),
        np.arange(count, dtype=np.int32), np.tile(np.eye(4), (count, 1, 1)),
    )  # fmt: skip


def moved(scene, offset=(0.0, 0.0, 0.0), up="z"):
    """Turned so that ``up`` is up, then moved in the world."""
    transforms = np.tile(np.eye(4), (len(scene), 1, 1))
    transforms[:, :3, :3] = np.eye(3)[list(TO_UP[up])]
    transforms[:, :3, 3] = offset
    return Scene(scene.meshes, scene.names, scene.mesh_of.copy(), transforms @ scene.transforms)


def flat(width, depth, low=(0.0, 0.0, 0.0)):
    """A rectangle of two triangles."""
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, depth, 0], [0, depth, 0]], float)
    return TriangleMesh.from_soup(corners + low, [[0, 1, 2], [0, 2, 3]])


def two_boxes(*, ground=True):
    """Two houses, 20 x 40 and 12 high, with a street of 8 between them."""
    houses = [box((20.0, 40.0, 12.0), (0.0, 0.0, 0.0)), box((20.0, 40.0, 12.0), (28.0, 0.0, 0.0))]
    return scene_of(*houses, *([flat(60.0, 52.0, (-6.0, -6.0, 0.0))] if ground else []))


def house(*, door_leaf=False):
    """Two rooms of 5 x 5, 2.6 high; doorways of 1.0 x 2.1 between them and from the first out."""
    slabs = [box((10.6, 5.4, 0.2), (0.0, 0.0, z)) for z in (-0.2, 2.6)]
    walls = [
        box((2.0, 0.2, 2.6), (0.0, 0.0, 0.0)), box((7.6, 0.2, 2.6), (3.0, 0.0, 0.0)),
        box((1.0, 0.2, 0.5), (2.0, 0.0, 2.1)), box((10.6, 0.2, 2.6), (0.0, 5.2, 0.0)),
        box((0.2, 5.0, 2.6), (0.0, 0.2, 0.0)), box((0.2, 5.0, 2.6), (10.4, 0.2, 0.0)),
        box((0.2, 2.0, 2.6), (5.2, 0.2, 0.0)), box((0.2, 2.0, 2.6), (5.2, 3.2, 0.0)),
        box((0.2, 1.0, 0.5), (5.2, 2.2, 2.1)),
    ]  # fmt: skip
    parts = [*slabs, *walls]
    names = [f"part {i}" for i in range(len(parts))]
    if door_leaf:
        parts.append(box((0.04, 1.0, 2.1), (5.28, 2.2, 0.0)))
        names.append("IfcDoor:inner:17")
    return scene_of(*parts, names=names)


def triangles(scene, *, without=""):
    """(m, 3, 3) of all objects, less those with a word in their names."""
    kept = [i for i, name in enumerate(scene.names) if not without or without not in name]
    mesh = scene.joined(kept)
    return mesh.vertices[mesh.faces]


def positions(path):
    return np.array([camera.position for camera in path.cameras])


def crossed(path, soup):
    """How many triangles the straight ways from camera to camera cross."""
    places = positions(path)
    lows, highs = soup.min(axis=1), soup.max(axis=1)
    count = 0
    for a, b in pairwise(places):
        near = (highs >= np.minimum(a, b)).all(axis=1) & (lows <= np.maximum(a, b)).all(axis=1)
        count += int(crossings(a[None], b[None], soup[near]).sum()) if near.any() else 0
    return count
