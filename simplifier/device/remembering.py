"""The processor, for one who draws a mesh several times: what was found out of it is kept.

A report draws the same silhouettes for precision and recall and for the front, and needs the edges
of the mesh for each picture; a refinement draws it in three sizes.  What is kept is of the mesh of
most triangles that came so far, which is known by its arrays, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from simplifier.device.device import Device, Faces, Processor, Vertices
from simplifier.kernels.coverage import MaskArray, coverage_masks
from simplifier.kernels.front import front_pixels
from simplifier.progress import TellShare, silent

if TYPE_CHECKING:
    from simplifier.kernels.contours import EdgeTable

_MOST_BYTES = 1 << 24  # of silhouettes that are kept


@dataclass
class _Pictures:
    """Silhouettes of ``image`` (rows, columns)."""

    image: tuple[int, int]
    projections: NDArray[np.float64]
    masks: MaskArray


@dataclass
class KnownMesh:
    """What was found out of a mesh: :class:`~simplifier.kernels.coverage.Known`.

    ``vertices``  (3, n) and ``faces`` (m, 3) of the mesh, where there is one yet.
    """

    vertices: Vertices = field(default_factory=lambda: np.empty((3, 0)))
    faces: Faces = field(default_factory=lambda: np.empty((0, 3), np.int32))
    _table: EdgeTable | None = None
    _pictures: list[_Pictures] = field(default_factory=list)

    def table_of(self, vertices: Vertices, faces: Faces) -> EdgeTable:
        from simplifier.kernels.contours import edge_table  # small meshes need not load it

        if self._table is not None and self.holds(vertices, faces):
            return self._table
        table = edge_table(vertices, faces)
        if len(faces) >= len(self.faces):
            self.vertices, self.faces = vertices, faces
            self._table, self._pictures = table, []
        return table

    def masks_of(
        self, vertices: Vertices, faces: Faces, projections: NDArray[np.float64], image: int
    ) -> MaskArray | None:
        if self.holds(vertices, faces):
            for one in self._pictures:
                if one.image == (image, image) and np.array_equal(one.projections, projections):
                    return one.masks
        return None

    def keep(
        self, vertices: Vertices, faces: Faces, projections: NDArray[np.float64],
        image: tuple[int, int], masks: MaskArray,
    ) -> None:  # fmt: skip
        """``masks`` (V, rows, words) of the mesh, drawn by ``projections`` (V, 2, 4)."""
        if masks.nbytes <= _MOST_BYTES and self.holds(vertices, faces):
            others = [one for one in self._pictures if one.image != image]
            self._pictures = [*others, _Pictures(image, projections, masks)]

    def holds(self, vertices: Vertices, faces: Faces) -> bool:
        same = self._table is not None and np.array_equal(self.faces, faces)
        return same and np.array_equal(self.vertices, vertices)


@dataclass(frozen=True)
class RememberingProcessor(Processor):
    """For one thread at a time, and as long as one measures."""

    known: KnownMesh = field(default_factory=KnownMesh)

    def coverage_masks(  # type: ignore[override]
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        rows: int,
        columns: int,
        tell: TellShare = silent,
    ) -> MaskArray:
        masks = coverage_masks(vertices, faces, projections, rows, columns, tell, self.known)
        self.known.keep(vertices.T, faces, projections, (rows, columns), masks)
        return masks

    def front_pixels(  # type: ignore[override]
        self,
        mesh: tuple[Vertices, Faces],
        occluder: tuple[Vertices, Faces],
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        return front_pixels(mesh, occluder, projections, image, threshold, self.known)


def remembering(device: Device) -> Device:
    """The same device for one who draws a mesh several times, with the same results."""
    return RememberingProcessor(device.remarks) if isinstance(device, Processor) else device
