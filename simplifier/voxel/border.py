"""TriangleMesh -> whether it has a border."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.thin import has_border

_ROUNDING = 1e-9
"""Of the longest edge: what a seam may gape, far less than 32-bit coordinates tell apart."""


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether every edge of the mesh has another face, vertices at one place being one."""
    if not has_border(mesh.faces):
        return True
    gap = _ROUNDING * float(mesh.extent.max())
    places = np.zeros(len(mesh.vertices), dtype=np.int64)
    for column in mesh.vertices.T:
        numbers = _numbered(column, gap)
        _, places = np.unique(places * (numbers.max() + 1) + numbers, return_inverse=True)
    return not has_border(places.astype(np.int32)[mesh.faces])


def _numbered(values: NDArray[np.float64], gap: float) -> NDArray[np.int64]:
    """The same number for values that lie within a gap of each other, or of those between them."""
    order = np.argsort(values)
    numbers = np.empty(len(values), dtype=np.int64)
    numbers[order[0]] = 0
    numbers[order[1:]] = np.cumsum(np.diff(values[order]) > gap)
    return numbers
