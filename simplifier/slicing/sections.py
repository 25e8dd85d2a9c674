"""SamplingPlan -> Section[]: the slice of largest area in each bin (section 4.2 of the paper)."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.section import Section
from simplifier.geometry.solid import BoolArray
from simplifier.progress import TellShare, silent
from simplifier.slicing.planes import SamplingPlan


class Slicer(Protocol):
    """Cuts one voxel solid by planes; every backend keeps this contract.

    A pixel is covered when its centre, on the plane, lies in the solid.  Backends agree on every
    pixel whose centre is more than 0.01 voxel from a voxel face.
    """

    def areas(self, plan: SamplingPlan, tell: TellShare = silent) -> NDArray[np.int64]:
        """(n,) covered pixels of each plane of the plan; ``tell`` hears the share that is cut."""

    def masks(self, plan: SamplingPlan, planes: NDArray[np.int64]) -> list[BoolArray]:
        """(rows, columns) bool masks of the named planes, in the frames of the plan."""


def best_sections(plan: SamplingPlan, slicer: Slicer, tell: TellShare = silent) -> list[Section]:
    """Cut every plane of the plan and keep, for each bin, the slice with the most pixels.

    Bins without a covered pixel give nothing.  Sections come in the order of their bins; of equal
    slices the first is kept.
    """
    areas = slicer.areas(plan, tell)
    order = np.lexsort((-areas, plan.bin_of))  # stable: by bin, then largest area, then index
    _, first = np.unique(plan.bin_of[order], return_index=True)
    chosen = order[first]
    chosen = chosen[areas[chosen] > 0]
    sections = []
    for index, mask in zip(chosen, slicer.masks(plan, chosen), strict=True):
        frame = plan.frames[plan.frame_of[index]]
        sections.append(Section(plan.plane(int(index)), mask, frame.corner, frame.pixel))
    return sections
