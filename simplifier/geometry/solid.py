"""Solid: what the input touches, what that encloses, and what closed it."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.geometry.grid import VoxelGrid


@dataclass(frozen=True)
class Closing:
    """One remedy that kept the outside out, and the voxels that it added to the solid."""

    by: str  # "ground" or "smallest_hole"
    voxels: int


@dataclass(frozen=True, eq=False)
class Solid:
    """The discretized input (section 4.1 of the paper).

    ``touched``  voxels that a triangle touches.
    ``filled``   those and the voxels that the outside cannot reach.
    ``core``     what sections are cut from: ``filled``, or only voxels that lie wholly inside;
                 without the regions that are to be left open.
    ``reach``    voxels that the occluder may go past the core: 1, or 0 for not at all.
    ``wholly_inside``  whether the core is the interior alone, without any touched voxel.
    ``closed_by``  remedies in use, in the order in which they were applied.
    """

    touched: VoxelGrid
    filled: VoxelGrid
    core: VoxelGrid
    reach: int = 1
    closed_by: tuple[Closing, ...] = ()
    wholly_inside: bool = False

    @property
    def inside_fraction(self) -> float:
        """Share of the grid's voxels that the solid holds."""
        return self.filled.count / self.filled.inside.size

    @property
    def enclosed_fraction(self) -> float:
        """Voxels that are inside without touching a triangle, as a share of the solid."""
        return 1.0 - self.touched.count / self.filled.count
