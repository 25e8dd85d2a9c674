"""The seam between what is to be drawn or measured, and what does it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import as_mesh
from simplifier.kernels.coverage import MaskArray, coverage_masks
from simplifier.kernels.front import depth_limits, front_pixels
from simplifier.kernels.measure import score_polygon_unions
from simplifier.kernels.overhang import overhang_pixels
from simplifier.kernels.random_quads import mean_quad_areas, sampled_quad_pixels
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent

Vertices = NDArray[np.float64]
"""(n, 3) float64."""

Faces = NDArray[np.int32]
"""(m, 3) int32."""

Surface = tuple[Vertices, Faces]

PolygonArrays = tuple[
    NDArray[np.float64], NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]
]
"""Points, lowest, offsets and maps of polygons, as :mod:`simplifier.kernels.measure` has them."""


@dataclass(frozen=True)
class QuadSample:
    """Which random quads are drawn: ``quads`` a view, whose first is number ``first_view``.

    A quad depends on (``seed``, view, number of the quad) alone.
    """

    quads: int
    seed: int
    first_view: int = 0

    def after(self, views: int) -> QuadSample:
        """The same, from so many views on."""
        return replace(self, first_view=self.first_view + views)


class Device(Protocol):
    """Draws and measures; every device gives the same bits.

    A method may be called on any thread.  What is wrong with its arguments is the same error on
    every device: ValueError, as :func:`~simplifier.kernels.coverage.coverage_masks` raises it.
    """

    @property
    def name(self) -> str:
        """``cpu``, or what OpenGL calls its renderer."""

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
        mesh: Surface,
        occluder: Surface,
        projections: NDArray[np.float64],
        image: int,
        threshold: float,
    ) -> NDArray[np.int64]:
        """(V, 2) pixels shown, and in front: :func:`~simplifier.kernels.front.front_pixels`."""

    def quad_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
        sample: QuadSample,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(V,) mean pixels of a quad, and (k, V, 3) those hidden rightly, missed and hidden wrongly
        by each of k occluders: :mod:`~simplifier.kernels.random_quads`, of silhouettes ``image``
        pixels a side."""

    def overhang_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(k, V, 2) pixels of the mesh and of each of k occluders beside it, and (k, V) how far
        out: :func:`~simplifier.kernels.overhang.overhang_pixels` of such silhouettes."""

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

    coverage_masks = staticmethod(coverage_masks)
    front_pixels = staticmethod(front_pixels)
    depth_limits = staticmethod(depth_limits)

    def quad_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
        sample: QuadSample,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        original = self.coverage_masks(*mesh, projections, image, image)
        pixels = np.empty((len(occluders), len(original), 3))
        for index, occluder in enumerate(occluders):
            hidden = self.coverage_masks(*occluder, projections, image, image)
            pixels[index] = sampled_quad_pixels(
                original, hidden, image,
                quads=sample.quads, seed=sample.seed, first_view=sample.first_view,
            )  # fmt: skip
        return mean_quad_areas(original), pixels

    def overhang_pixels(
        self,
        mesh: Surface,
        occluders: Sequence[Surface],
        projections: NDArray[np.float64],
        image: int,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        original = self.coverage_masks(*mesh, projections, image, image)
        pixels = np.empty((len(occluders), len(original), 2), dtype=np.int64)
        farthest = np.empty(pixels.shape[:2], dtype=np.int64)
        for index, occluder in enumerate(occluders):
            hidden = self.coverage_masks(*occluder, projections, image, image)
            pixels[index], farthest[index] = overhang_pixels(original, hidden, image)
        return pixels, farthest

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
