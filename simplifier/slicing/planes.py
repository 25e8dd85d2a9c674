"""VoxelGrid -> SamplingPlan: which planes are tried (section 4.2 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.section import ImageFrame, Plane
from simplifier.geometry.solid import VoxelGrid
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.options.stages import SectionOptions
from simplifier.slicing.flats import NO_DIRECTIONS

_PIXEL = 1.0  # a voxel; its whole cross-section then covers at least one pixel centre


@dataclass(frozen=True, eq=False)
class SamplingPlan:
    """All planes to try, and the bins of which each keeps its best.

    ``frames``  one picture frame a direction.
    ``frame_of``, ``bin_of``  (n,) int32: direction and bin of each plane; planes of one direction
                follow each other.
    ``depths``  (n,) float64: depth of each plane along its direction, in voxels.
    ``bins``    number of bins.
    """

    frames: tuple[ImageFrame, ...]
    frame_of: IntArray
    bin_of: IntArray
    depths: FloatArray
    bins: int

    def __len__(self) -> int:
        return len(self.depths)

    def plane(self, index: int) -> Plane:
        return Plane(self.frames[self.frame_of[index]].axes, float(self.depths[index]))


def plan_sections(
    grid: VoxelGrid, options: SectionOptions, flats: FloatArray = NO_DIRECTIONS
) -> SamplingPlan:
    """Spread planes over the directions of a hemisphere and the depths of the solid.

    Directions: the three grid axes, the normals of large flat parts (k, 3), a bin each, then
    ``options.directions`` even directions; each even one is a bin of ``options.direction_samples``
    directions near it.  Depths: the solid's extent along each direction in ``options.depths`` bins
    of equal width, with planes about ``options.depth_step`` voxels apart in each, or further to
    keep to ``options.depth_samples`` a bin.  The planes of a grid axis run through voxel centres,
    never along faces.
    """
    directions, direction_bin = _directions(options, flats)
    frames, low, high = _frames(grid, image_axes(directions))
    frame_of, bin_of, depths = [], [], []
    for index, owner in enumerate(direction_bin):
        at = _depths(low[index], high[index], options, aligned=index < 3)
        share = np.minimum(
            ((at - low[index]) * options.depths / (high[index] - low[index])).astype(np.int64),
            options.depths - 1,
        )
        depths.append(at)
        frame_of.append(np.full(len(at), index))
        bin_of.append(owner * options.depths + share)
    return SamplingPlan(
        frames,
        np.concatenate(frame_of).astype(np.int32),
        np.concatenate(bin_of).astype(np.int32),
        np.concatenate(depths),
        (int(direction_bin[-1]) + 1) * options.depths,
    )


def _directions(options: SectionOptions, flats: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Unit directions and the bin of each; a finer lattice is dealt to its nearest bin centres."""
    centres = hemisphere_directions(options.directions)
    samples = hemisphere_directions(options.directions * options.direction_samples)
    cosines = samples @ centres.T
    nearest = np.abs(cosines).argmax(axis=1)
    # Across the horizon the nearest centre may be that of -d: turned, so that near directions of a
    # bin count their depths from the same side.
    samples[cosines[np.arange(len(samples)), nearest] < 0.0] *= -1.0
    order = np.argsort(nearest, kind="stable")
    _, dense = np.unique(nearest[order], return_inverse=True)
    directions = np.concatenate([np.eye(3), flats, samples[order]])
    first = 3 + len(flats)
    return directions, np.concatenate([np.arange(first), first + dense])


def _frames(
    grid: VoxelGrid, axes: FloatArray
) -> tuple[tuple[ImageFrame, ...], FloatArray, FloatArray]:
    """A frame that holds the whole grid for each direction, and the depth range of the solid."""
    shape = np.array(grid.shape, dtype=np.float64)
    corners = np.array(np.meshgrid(*[(0.0, s) for s in shape], indexing="ij")).reshape(3, 8)
    projected = axes @ corners  # (n, 3, 8): u, v, d of the grid's corners
    low, high = projected.min(axis=2), projected.max(axis=2)
    # Centred, so that axis-aligned pixels have their centres at voxel centres.
    counts = np.maximum(np.ceil((high - low)[:, :2] / _PIXEL - 1e-9), 1.0)
    corner = (low + high)[:, :2] / 2.0 - counts * _PIXEL / 2.0
    frames = tuple(
        ImageFrame(axes[i], corner[i], int(counts[i, 1]), int(counts[i, 0]), _PIXEL)
        for i in range(len(axes))
    )
    return frames, low[:, 2], high[:, 2]


def _depths(low: float, high: float, options: SectionOptions, *, aligned: bool) -> FloatArray:
    most = options.depths * options.depth_samples
    step = 1.0 if aligned else options.depth_step
    count = max(int(np.ceil((high - low) / step - 1e-9)), 1)
    if aligned and count > most:
        # Every k-th voxel centre: a plane between two voxels would run along their faces.
        stride = -(-count // most)
        return np.asarray(low + np.arange(stride // 2, count, stride) + 0.5)
    count = min(count, most)
    return np.asarray(low + (np.arange(count) + 0.5) * (high - low) / count)
