"""A dense city: buildings of Lyon, each of some thousand triangles that no plane holds any more.

Engines meet scanned and sculpted buildings, of which no triangle hides anything by itself.  So some
buildings of the asset are subdivided, and their vertices shaken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene

BUILDINGS = 500
SHAKE = 0.02  # metres that a vertex moves along each axis at most
LEAST = 2300  # triangles of a building at least, so that 500 have 2.3 million


def some_buildings(source: Scene, count: int = BUILDINGS, seed: int = 0) -> Scene:
    """Objects drawn from all of a scene, as they are: between them one sees far."""
    drawn = np.random.default_rng(seed).choice(len(source), count, replace=False)
    chosen = np.sort(drawn)
    return Scene(
        tuple(source.meshes[mesh] for mesh in source.mesh_of[chosen]),
        tuple(source.names[index] for index in chosen),
        np.arange(count, dtype=np.int32),
        source.transforms[chosen],
    )


def dense(source: Scene, least: int = LEAST, seed: int = 0) -> Scene:
    """Each mesh subdivided until it has ``least`` triangles or up to four times as many.

    Vertices that are equal move together, so what is closed stays closed.
    """
    random = np.random.default_rng(seed)
    meshes = []
    for mesh in source.meshes:
        finer = welded(mesh)
        while len(finer.faces) < least:
            finer = subdivided(finer)
        moved = finer.vertices + random.uniform(-SHAKE, SHAKE, finer.vertices.shape)
        meshes.append(TriangleMesh(moved, finer.faces))
    return replace(source, meshes=tuple(meshes))


def welded(mesh: TriangleMesh) -> TriangleMesh:
    """Vertices at one place become one."""
    points, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return TriangleMesh.from_soup(points, place.ravel()[mesh.faces])


def subdivided(mesh: TriangleMesh) -> TriangleMesh:
    """Four triangles for each, by the middles of its edges, which neighbours share."""
    faces = mesh.faces.astype(np.int64)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    ends, of_edge = np.unique(edges, axis=0, return_inverse=True)
    middle = of_edge.reshape(-1, 3) + len(mesh.vertices)
    a, b, c = faces.T
    ab, bc, ca = middle.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return TriangleMesh(
        np.concatenate([mesh.vertices, mesh.vertices[ends].mean(axis=1)]),
        np.concatenate([np.stack(one, axis=1) for one in quarters]).astype(np.int32),
    )
