"""Plans that the planner would not make, for slicers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.section import ImageFrame
from simplifier.slicing.planes import SamplingPlan


def every_depth_plan(
    axes: FloatArray, corner: Sequence[float], rows: int, columns: int, pixel: float,
    depths: Sequence[float],
) -> SamplingPlan:  # fmt: skip
    """Every frame, of ``axes`` (n, 3, 3) and one size, cut at every depth."""
    frames = tuple(ImageFrame(a, np.array(corner), rows, columns, pixel) for a in axes)
    n = len(frames) * len(depths)
    return SamplingPlan(
        frames,
        np.repeat(np.arange(len(frames)), len(depths)).astype(np.int32),
        np.zeros(n, dtype=np.int32),
        np.tile(np.array(depths, dtype=np.float64), len(frames)),
        1,
    )
