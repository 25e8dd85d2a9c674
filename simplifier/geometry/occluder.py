"""Occluder: the result, a handful of triangles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simplifier.geometry.arrays import check_arrays
from simplifier.geometry.mesh import FloatArray, IntArray, have_area

AN_OCCLUDER = "what simplifier.simplify or simplifier.load_occluder returns"
"""What to hand over where an occluder is asked for."""


@dataclass(frozen=True, eq=False)
class Occluder:
    """Triangles that hide nearly what the original hides.

    ``vertices``     (n, 3) float64, world units.
    ``faces``        (m, 3) int32, m may be 0 when nothing can be hidden.
    ``error_bound``  no point of the occluder, but of parts drawn by hand, is further than this
                     from the original's surface or its filled interior, world units; infinite when
                     nothing was promised (a file made elsewhere).
    ``timings``      seconds by stage.
    ``single_sided`` whether renderers that cull back faces may: a triangle that can be seen from
                     both sides is then there in both windings.  If not, as they are made, they are
                     to be drawn double-sided.

    Raises :class:`~simplifier.errors.MeshError` for arrays of another kind or shape; what they hold
    is checked where it is used.  Both become read-only.
    """

    vertices: FloatArray
    faces: IntArray
    error_bound: float = float("inf")
    timings: Mapping[str, float] = field(default_factory=dict)
    single_sided: bool = False

    @classmethod
    def of(
        cls, triangles: FloatArray, error_bound: float, timings: Mapping[str, float]
    ) -> Occluder:
        """Of a soup (m, 3, 3), world units: equal corners become one vertex.

        Triangles without area are left out, and of those with the same corners all but the first.
        """
        vertices, place = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        faces = place.reshape(-1, 3)[have_area(triangles)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        used, corners = np.unique(faces[np.sort(first)], return_inverse=True)
        return cls(
            vertices[used], np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32),
            error_bound, dict(timings),
        )  # fmt: skip

    def __post_init__(self) -> None:
        check_arrays(self.vertices, self.faces, "pass arrays as simplifier.Occluder states them")
