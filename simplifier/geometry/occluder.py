"""Occluder: the result, a handful of triangles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from simplifier.geometry.mesh import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Occluder:
    """Triangles that hide nearly what the original hides; to be drawn double-sided.

    ``vertices``     (n, 3) float64, world units.
    ``faces``        (m, 3) int32, m may be 0 when nothing can be hidden.
    ``error_bound``  no point of the occluder is further than this from the original's surface or
                     its filled interior, world units; infinite when nothing was promised (a file
                     made elsewhere).
    ``timings``      seconds by stage.
    """

    vertices: FloatArray
    faces: IntArray
    error_bound: float = float("inf")
    timings: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.vertices.setflags(write=False)
        self.faces.setflags(write=False)
