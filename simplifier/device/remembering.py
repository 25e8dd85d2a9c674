"""The processor, for one who draws a mesh several times: what was found out of it is kept.

A report draws the same silhouettes for precision and recall and for the front, and needs the edges
of the mesh for each picture; a refinement draws it in three sizes; levels of detail, and the runs
of a sweep, are judged one after the other in the same pictures.  What is kept is of the mesh of
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

_MOST_BYTES = 1 << 24  # of silhouettes that are kept, of one size
_MOST_SIZES = 3  # of which silhouettes are kept, the latest


@dataclass
class _Pictures:
    """Silhouettes of ``image`` (rows, columns)."""

    image: tuple[int, int]
    projections: NDArray[np.float64]
    masks: MaskArray


@dataclass
class _Mesh:
    """``vertices`` (3, n) and ``faces`` (m, 3), their edges if they are kept, and what was drawn of
    them."""

    vertices: Vertices
    faces: Faces
    table: EdgeTable | None = None
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
        held = self._held(vertices, faces)
        return held is not None and held.table is not None

    def table_of(self, vertices: Vertices, faces: Faces) -> EdgeTable:
        from simplifier.kernels.contours import edge_table  # small meshes need not load it

        held = self._held(vertices, faces)
        if held is not None and (table := held.table) is not None:
            return table
        table = edge_table(vertices, faces)
        held = held or self._hold(vertices, faces)
        if held is not None:
            held.table = table
        return table

    def _hold(self, vertices: Vertices, faces: Faces) -> _Mesh | None:
        """Take another mesh for the known one, unless that has more triangles."""
        if self._mesh is not None and len(faces) < len(self._mesh.faces):
            return None
        self._mesh = _Mesh(vertices, faces)
        return self._mesh

    def forget_edges(self) -> None:
        """Let go of what takes most memory: pictures that are known stay so."""
        if self._mesh is not None:
            self._mesh.table = None

    def masks_of(
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        image: tuple[int, int],
    ) -> MaskArray | None:
        held = self._held(vertices, faces)
        for one in held.pictures if held is not None else ():
            if one.image == image and np.array_equal(one.projections, projections):
                return one.masks
        return None

    def keep(
        self, vertices: Vertices, faces: Faces, projections: NDArray[np.float64],
        image: tuple[int, int], masks: MaskArray,
    ) -> None:  # fmt: skip
        """``masks`` (V, rows, words) of the mesh, drawn by ``projections`` (V, 2, 4)."""
        if masks.nbytes > _MOST_BYTES:
            return
        held = self._held(vertices, faces) or self._hold(vertices, faces)
        if held is not None:
            others = [one for one in held.pictures if one.image != image]
            latest = [*others, _Pictures(image, projections, masks)]
            held.pictures = latest[-_MOST_SIZES:]


@dataclass(frozen=True)
class RememberingProcessor(Processor):
    """For as long as one measures, or refines.  Silhouettes that it gives are not to be changed."""

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
        image = rows, columns
        there = self.known.masks_of(vertices.T, faces, projections, image)
        if there is not None:
            return there
        masks = coverage_masks(vertices, faces, projections, rows, columns, tell, self.known)
        self.known.keep(vertices.T, faces, projections, image, masks)
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


def rest(device: Device) -> None:
    """Have a device keep pictures alone, for one who has other work before drawing them again."""
    if isinstance(device, RememberingProcessor):
        device.known.forget_edges()
