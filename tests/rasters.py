"""Rasterising by brute force: every pixel's ray against every triangle."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from simplifier.geometry.camera import Camera, Lens


def rays(camera, rows, columns, per_pixel=1):
    """(rows k, columns k, 3) directions of depth 1 through the centres of k x k parts of pixels."""
    focal = Lens(rows, camera.fov).focal
    x = (np.arange(columns * per_pixel) + 0.5) / per_pixel - 0.5 * columns
    y = 0.5 * rows - (np.arange(rows * per_pixel) + 0.5) / per_pixel
    x, y = np.meshgrid(x / focal, y / focal)
    right, up, forward = camera.axes
    return x[..., None] * right + y[..., None] * up + forward


def hits(triangle, camera, directions):
    """Of one triangle (3, 3): (reciprocal depth, or 0 where a ray misses; is it a near miss).

    A ray's direction d is a combination of the corners, seen from the camera, with weights w: it
    meets the triangle when no weight is below 0, and then at depth 1 / sum(w).
    """
    corners = np.asarray(triangle, dtype=np.float64) - camera.position
    scale = np.abs(corners).max() ** 3
    across = np.cross(corners[[1, 2, 0]], corners[[2, 0, 1]])
    volume = corners[0] @ across[0]
    if abs(volume) < 1e-9 * scale:  # seen from its edge
        nothing = np.zeros(directions.shape[:2])
        return nothing, np.ones(nothing.shape, dtype=bool)
    weights = directions @ across.T / volume
    reciprocal = weights.sum(axis=-1)
    least = weights.min(axis=-1)
    inside = (least >= 0.0) & (reciprocal <= 1.0 / camera.near)
    doubt = (np.abs(weights) < 1e-9 * np.abs(weights).max(axis=-1, keepdims=True)).any(axis=-1)
    doubt |= np.abs(reciprocal * camera.near - 1.0) < 1e-9
    return np.where(inside, reciprocal, 0.0), doubt


def nearest(triangles, camera, rows, columns, per_pixel=1):
    """(reciprocal depth, doubt) of the nearest of triangles (m, 3, 3), by pixel."""
    directions = rays(camera, rows, columns, per_pixel)
    depth, doubt = np.zeros(directions.shape[:2]), np.zeros(directions.shape[:2], dtype=bool)
    for triangle in triangles:
        values, unsure = hits(triangle, camera, directions)
        depth, doubt = np.maximum(depth, values), doubt | unsure
    return depth, doubt


LATTICE = 16
"""Rows and columns of the screen on whose centres the corners of lattice meshes lie."""

lattice_places = st.lists(
    st.tuples(st.integers(0, LATTICE - 1), st.integers(0, LATTICE - 1)), min_size=4, max_size=30
)


def lattice_mesh(places):
    """(places, vertices, faces, camera) of triangles that share edges, or None without an area.

    At depth 1 with this lens a unit is a pixel, so corners lie on centres: all ties are at work.
    The picture shows ``places``, (x, y) in pixels, turned by half: world x runs to the left of it
    and y upwards.
    """
    points = np.unique(np.array(places), axis=0) + 0.5
    if np.linalg.matrix_rank(points - points[0]) < 2:
        return None
    half = LATTICE / 2.0
    fov = float(np.degrees(2.0 * np.arctan(half)))
    camera = Camera.looking(np.zeros(3), np.array([0, 0, 1.0]), np.array([0, 1.0, 0]), fov, 0.5)
    vertices = np.column_stack([points - half, np.ones(len(points))])
    return points, vertices, Delaunay(points).simplices.astype(np.int32), camera


def looking_ahead(position=(0.0, 0.0, 0.0), fov=70.0, near=0.25):
    """A camera along +z with x to the left and y up, not aligned with anything."""
    forward, up = np.array([0.1, -0.05, 1.0]), np.array([0.03, 1.0, 0.0])
    return Camera.looking(np.asarray(position, dtype=np.float64), forward, up, fov, near)


def random_camera(rng):
    """Anywhere, looking anywhere."""
    position, forward, up = rng.normal(size=(3, 3))
    return Camera.looking(position, forward, up, rng.uniform(30.0, 110.0), 0.1)
