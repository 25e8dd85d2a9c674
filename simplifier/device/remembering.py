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

from simplifier.device.device import Device, Faces, Processor, Surface, Vertices
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
class _Mesh:
    """``vertices`` (3, n) and ``faces`` (m, 3), their edges, and what was drawn of them."""

    vertices: Vertices
    faces: Faces
    table: EdgeTable
    pictures: list[_Pictures] = field(default_factory=list)


@dataclass
class KnownMesh:
    """What was found out of a mesh: :class:`~simplifier.kernels.coverage.Known`.

    Threads may ask at once: another mesh takes the place of one as a whole.
    """

    _mesh: _Mesh | None = None

    def _held(self, vertices: Vertices, faces: Faces) -> _Mesh | None:
        known = self._mesh
        if known is None or not np.array_equal(known.faces, faces):
            return None
        return known if np.array_equal(known.vertices, vertices) else None

    def holds(self, vertices: Vertices, faces: Faces) -> bool:
        return self._held(vertices, faces) is not None

    def table_of(self, vertices: Vertices, faces: Faces) -> EdgeTable:
        from simplifier.kernels.contours import edge_table  # small meshes need not load it

        held = self._held(vertices, faces)
        if held is not None:
            return held.table
        found = _Mesh(vertices, faces, edge_table(vertices, faces))
        if self._mesh is None or len(faces) >= len(self._mesh.faces):
            self._mesh = found
        return found.table

    def masks_of(
        self, vertices: Vertices, faces: Faces, projections: NDArray[np.float64], image: int
    ) -> MaskArray | None:
        held = self._held(vertices, faces)
        for one in held.pictures if held is not None else ():
            if one.image == (image, image) and np.array_equal(one.projections, projections):
                return one.masks
        return None

    def keep(
        self, vertices: Vertices, faces: Faces, projections: NDArray[np.float64],
        image: tuple[int, int], masks: MaskArray,
    ) -> None:  # fmt: skip
        """``masks`` (V, rows, words) of the mesh, drawn by ``projections`` (V, 2, 4)."""
        held = self._held(vertices, faces) if masks.nbytes <= _MOST_BYTES else None
        if held is not None:
            others = [one for one in held.pictures if one.image != image]
            held.pictures = [*others, _Pictures(image, projections, masks)]


@dataclass(frozen=True)
class RememberingProcessor(Processor):
    """For as long as one measures, or refines."""

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
        mesh: Surface,
        occluder: Surface,
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        return front_pixels(mesh, occluder, projections, image, threshold, self.known)


def remembering(device: Device) -> Device:
    """The same device for one who draws a mesh several times, with the same results."""
    return RememberingProcessor(device.remarks) if isinstance(device, Processor) else device
