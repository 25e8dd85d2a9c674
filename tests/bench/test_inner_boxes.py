"""Inner boxes as triangles."""

from __future__ import annotations

import numpy as np

from bench.inner_boxes import TRIANGLES, inner_boxes
from simplifier.geometry.solid import VoxelGrid


def test_a_box_has_twelve_triangles_around_its_volume():
    inside = np.zeros((4, 5, 6), dtype=np.bool_)
    inside[1:3, 1:4, 1:5] = True
    points, faces = inner_boxes(VoxelGrid(inside, np.array([10.0, 0.0, -1.0]), 0.5), 3)
    assert faces.shape == (TRIANGLES, 3)
    assert points.min(axis=0).tolist() == [10.5, 0.5, -0.5]
    assert points.max(axis=0).tolist() == [11.5, 2.0, 1.5]
    a, b, c = (points[faces[:, corner]] - points.mean(axis=0) for corner in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    assert abs(np.abs(volumes).sum() - 3.0) < 1e-12
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
