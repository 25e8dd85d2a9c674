"""A dense city: buildings of Lyon, each of some thousand triangles that no plane holds any more.

Engines meet scanned and sculpted buildings, of which no triangle hides anything by itself.  So some
buildings of the asset are subdivided, and their vertices shaken.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import IntArray, TriangleMesh
from simplifier.geometry.scene import Scene

FILE = "city_lyon_buildings.glb"
BUILDINGS = 500
SHAKE = 0.02  # metres that a vertex moves along each axis at most
LEAST = 2300  # triangles of a building at least, so that all have 2.4 million


def central(source: Scene, count: int = BUILDINGS) -> IntArray:
    """The objects of a scene with z up that stand nearest to its middle: narrow streets."""
    places = source.bounds().mean(axis=1)[:, :2]
    away = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    return np.sort(np.argsort(away, kind="stable")[:count]).astype(np.int32)


def scattered(source: Scene, count: int = BUILDINGS, seed: int = 0) -> IntArray:
    """Objects drawn from all of a scene: gaps through which one sees far."""
    chosen = np.random.default_rng(seed).choice(len(source), count, replace=False)
    return np.sort(chosen).astype(np.int32)


def dense_city(source: Scene, chosen: IntArray, least: int = LEAST, seed: int = 0) -> Scene:
    """Those objects, each subdivided until it has ``least`` triangles or up to four times as many.

    Vertices that are equal move together, so what is closed stays closed.
    """
    random = np.random.default_rng(seed)
    meshes = []
    for index in chosen:
        mesh = welded(source.meshes[source.mesh_of[index]])
        while len(mesh.faces) < least:
            mesh = subdivided(mesh)
        moved = mesh.vertices + random.uniform(-SHAKE, SHAKE, mesh.vertices.shape)
        meshes.append(TriangleMesh(moved, mesh.faces))
    return Scene(
        tuple(meshes),
        tuple(source.names[index] for index in chosen),
        np.arange(len(chosen), dtype=np.int32),
        source.transforms[chosen],
    )


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
