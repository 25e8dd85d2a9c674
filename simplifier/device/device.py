"""The seam between what is to be drawn or measured, and what does it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import as_mesh
from simplifier.kernels.coverage import MaskArray, coverage_masks
from simplifier.kernels.front import depth_limits, front_pixels
from simplifier.kernels.measure import score_polygon_unions
from simplifier.kernels.threads import run_chunks
from simplifier.options.simplify import Slicing
from simplifier.progress import TellShare, silent

Vertices = NDArray[np.float64]
"""(n, 3) float64."""

Faces = NDArray[np.int32]
"""(m, 3) int32."""

PolygonArrays = tuple[
    NDArray[np.float64], NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]
]
"""Points, lowest, offsets and maps of polygons, as :mod:`simplifier.kernels.measure` has them."""


class Device(Protocol):
    """Draws and measures; every device gives the same bits, but for what cuts sections.

    A method may be called on any thread.  What is wrong with its arguments is the same error on
    every device: ValueError, as :func:`~simplifier.kernels.coverage.coverage_masks` raises it.
    """

    @property
    def name(self) -> str:
        """``cpu``, or what OpenGL calls its renderer."""

    @property
    def slicer(self) -> Slicing:
        """What cuts sections where none is named.  Slicers differ in a pixel in 100,000."""

    @property
    def remarks(self) -> Sequence[str]:
        """What the user should know of it, a sentence each."""

    def coverage_masks(
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        rows: int,
        columns: int,
        tell: TellShare = silent,
    ) -> MaskArray:
        """(V, rows, words) uint64, as of :func:`~simplifier.kernels.coverage.coverage_masks`."""

    def front_pixels(
        self,
        mesh: tuple[Vertices, Faces],
        occluder: tuple[Vertices, Faces],
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        """(V, 2) pixels shown, and in front: :func:`~simplifier.kernels.front.front_pixels`."""

    def depth_limits(
        self,
        vertices: Vertices,
        faces: Faces,
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.float32]:
        """(V, image, image) depths: :func:`~simplifier.kernels.front.depth_limits`."""

    def polygon_scores(
        self,
        shapes: PolygonArrays,
        polygons: NDArray[np.int32],
        levels: NDArray[np.int32],
        base: NDArray[np.uint64],
        tell: TellShare = silent,
    ) -> NDArray[np.int64]:
        """(k,) twice the occlusion measure of ``base`` (V, 64) with each polygon added, one at a
        time: :func:`~simplifier.kernels.measure.score_polygon_unions`."""


@dataclass(frozen=True)
class Processor:
    """The processor's cores, by the kernels."""

    remarks: Sequence[str] = ()

    @property
    def name(self) -> str:
        return "cpu"

    @property
    def slicer(self) -> Slicing:
        return "cpu"

    coverage_masks = staticmethod(coverage_masks)
    front_pixels = staticmethod(front_pixels)
    depth_limits = staticmethod(depth_limits)

    def polygon_scores(
        self,
        shapes: PolygonArrays,
        polygons: NDArray[np.int32],
        levels: NDArray[np.int32],
        base: NDArray[np.uint64],
        tell: TellShare = silent,
    ) -> NDArray[np.int64]:
        scores = np.zeros(len(polygons), dtype=np.int64)
        run_chunks(
            lambda begin, end: score_polygon_unions(
                *shapes, polygons, levels, base, begin, end, scores
            ),
            len(polygons),
            least=4,
            tell=tell,
        )
        return scores


PROCESSOR = Processor()
"""The device where none is asked for."""


def soup_masks(
    device: Device, triangles: NDArray[np.float64], projections: NDArray[np.float64], pixels: int
) -> MaskArray:
    """Silhouettes of a soup (m, 3, 3), ``pixels`` a side."""
    return device.coverage_masks(*as_mesh(triangles), projections, pixels, pixels)
