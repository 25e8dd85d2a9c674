"""The CPU slicer: reads the voxel grid at every pixel centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.section import ImageFrame
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.kernels.sampler import sample_plane, slice_areas
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.slicing.planes import SamplingPlan


class GridSampler:
    """Keeps the contract of :class:`simplifier.slicing.sections.Slicer` on the processor."""

    def __init__(self, grid: VoxelGrid) -> None:
        self._padded = np.pad(grid.inside, 1).view(np.uint8)

    def areas(self, plan: SamplingPlan, tell: TellShare = silent) -> NDArray[np.int64]:
        """(n,) covered pixels of each plane of the plan."""
        table = np.stack([_row(frame) for frame in plan.frames])
        areas = np.zeros(len(plan), dtype=np.int64)
        run_chunks(
            lambda begin, end: slice_areas(
                self._padded, table, plan.frame_of, plan.depths, begin, end, areas
            ),
            len(plan),
            least=16,
            chunks_per_thread=32,
            tell=tell,
        )
        return areas

    def masks(self, plan: SamplingPlan, planes: NDArray[np.int64]) -> list[BoolArray]:
        """(rows, columns) bool masks of the named planes."""
        masks = []
        for index in planes:
            frame = plan.frames[plan.frame_of[index]]
            mask = np.zeros((frame.rows, frame.columns), dtype=np.bool_)
            sample_plane(self._padded, _row(frame), plan.depths[index], mask)
            masks.append(mask)
        return masks


def _row(frame: ImageFrame) -> NDArray[np.float64]:
    """A frame as the kernel's row of numbers: u, v, d, corner, pixel, rows, columns."""
    return np.concatenate(
        [frame.axes.ravel(), frame.corner, [frame.pixel, frame.rows, frame.columns]]
    )
