"""Slices + ViewCells -> what each cell may see: shafts that slices close.

Schaufler, Dorsey, Decoret and Sillion, "Conservative Volumetric Visibility with Occluder Fusion"
(2000) look for what is behind blocks of solid voxels.  Here the question is put the other way
round, for a box of viewers and a box of targets at once: their *shaft* (Haines and Wallace, "Shaft
Culling for Efficient Ray-Traced Radiosity", 1991), the hull of both, holds all lines of sight
between them.  If a slice between the boxes covers its whole section, none gets through.  That takes
no erosion across the slice, so that a pane hides all that is behind it.  What is in no slice, being
open and curved or slanted, closes shafts as a sheet of triangles (``kernels/sheets.py``).

Boxes are divided until all shafts are closed, or one is found that stays open.  What lies in a cell
is always visible from it.  Viewers are in free space: what one would see from within a wall is not
asked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels.shafts import see
from simplifier.kernels.threads import run_chunks
from simplifier.kernels.voxelize import mark_triangles
from simplifier.progress import TellCount, TellShare, silent
from simplifier.visibility.slices.box_tree import tree_over
from simplifier.visibility.slices.slices import AXES, Grid, Slices

_TRIES = 16  # random lines to each object, which find most of what is visible
_LIMIT = 2000  # shafts between a cell and an object; beyond them it counts as visible
_SHEET_LIMIT = 2  # of these that sheets are looked for in
_FAR = 255

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Targets:
    """The voxels that objects touch, in trees of boxes that hold two others each, float64 voxels.

    Arrays as :func:`~simplifier.kernels.shafts.see` takes them.
    """

    boxes: FloatArray
    children: Ids
    roots: Ids
    leaves: Ids

    @classmethod
    def of(
        cls, upright: UprightScene, grid: Grid, tell: TellCount = lambda done, total: None
    ) -> Targets:
        """Of all objects of the scene, in its order."""
        boxes, children, count = [], [], 0
        roots = np.full(len(upright.scene), -1, dtype=np.int64)
        leaves = np.zeros((len(upright.scene), 2), dtype=np.int64)
        for index in range(len(upright.scene)):
            tell(index, len(upright.scene))
            voxels = _touched(upright, grid, index).astype(np.float64)
            if len(voxels) == 0:
                continue
            own, below, _ = tree_over(voxels, voxels + 1)
            # The object itself is no larger than its box, which may end within a voxel.
            low, high = grid.to_grid(upright.boxes[index])
            own[:, :3] = np.clip(own[:, :3], low, high)
            own[:, 3:] = np.clip(own[:, 3:], low, high)
            boxes.append(own)
            children.append(below + count)
            leaves[index] = count, count + int(np.count_nonzero(below[:, 0] == below[:, 1]))
            count += len(own)
            roots[index] = count - 1
        return cls(
            np.concatenate([np.empty((0, 6)), *boxes]),
            np.concatenate([np.empty((0, 2), np.int64), *children]), roots, leaves,
        )  # fmt: skip


def _touched(upright: UprightScene, grid: Grid, index: int) -> Ids:
    """(k, 3) the voxels that an object touches."""
    mesh = upright.scene.joined([index])
    vertices = np.ascontiguousarray(mesh.vertices[:, upright.order] - upright.origin)
    low = np.floor(grid.to_grid(upright.boxes[index, 0]) - 1e-6).astype(np.int64)
    high = np.floor(grid.to_grid(upright.boxes[index, 1]) + 1e-6).astype(np.int64)
    touched = np.zeros(tuple(high - low + 1), dtype=np.bool_)
    origin = low * grid.cell + grid.origin
    mark_triangles(vertices, mesh.faces, origin, 1.0 / grid.cell, 0, len(mesh.faces), touched)
    return np.argwhere(touched) + low


@dataclass(frozen=True, eq=False)
class Shafts:
    """What visibility is looked up in, once for all cells.

    Arrays as :func:`~simplifier.kernels.shafts.see` takes them.
    """

    slices: Slices
    targets: Targets
    free: NDArray[np.uint8]
    firsts: tuple[Ids, Ids, Ids]
    sums: tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]

    @classmethod
    def of(cls, slices: Slices, targets: Targets) -> Shafts:
        shape = slices.grid.shape
        covered = np.zeros(tuple(shape), dtype=np.bool_)
        firsts, sums = [], []
        for axes, ats, masks in zip(AXES, slices.ats, slices.covered, strict=True):
            layers = np.arange(shape[axes[0]] + 1)
            firsts.append(np.searchsorted(ats, layers).astype(np.int64))
            turned = covered.transpose(axes)
            for at, mask in zip(ats, masks, strict=True):
                turned[int(at)] |= mask  # of voxels of these numbers
            sums.append(_sums(masks))
        return cls(
            slices, targets, _free(covered), (firsts[0], firsts[1], firsts[2]),
            (sums[0], sums[1], sums[2]),
        )  # fmt: skip


def _sums(masks: BoolArray) -> NDArray[np.int32]:
    """Covered pixels below each corner, by slice."""
    count, nv, nw = masks.shape
    sums = np.zeros((nv + 1, nw + 1, count), dtype=np.int32)
    sums[1:, 1:] = masks.transpose(1, 2, 0)
    for axis in (1, 0):
        np.cumsum(sums, axis=axis, out=sums)
    return sums


def _free(covered: BoolArray) -> NDArray[np.uint8]:
    """Steps to the nearest voxel that is covered."""
    if not covered.any():
        return np.full(covered.shape, _FAR, dtype=np.uint8)
    steps = ndimage.distance_transform_cdt(~covered, metric="chessboard")
    return np.asarray(np.minimum(steps, _FAR), dtype=np.uint8)


def see_by_shafts(
    shafts: Shafts, cells: ViewCells, tell: TellShare = silent, seed: int = 0
) -> tuple[BoolArray, Ids]:
    """(c, n) whether each object may be visible from each cell, and (c,) how many shafts that took.

    A prism counts as the box around it.  ``seed`` of the lines that are tried first.
    """
    targets, grid, sheets = shafts.targets, shafts.slices.grid, shafts.slices.sheets
    seen = np.zeros((len(cells), len(targets.roots)), dtype=np.bool_)
    work = np.zeros((len(cells), 1), dtype=np.int64)
    places = np.concatenate([grid.to_grid(cells.low), grid.to_grid(cells.high)], axis=1)

    def look(begin: int, end: int) -> None:
        see(
            begin, end, places, targets.roots, targets.leaves, targets.boxes, targets.children,
            _TRIES, seed, _LIMIT, _SHEET_LIMIT, shafts.free, shafts.slices.ats, shafts.firsts,
            shafts.slices.edges, shafts.sums, sheets.points, sheets.faces, sheets.normals,
            sheets.beside, sheets.boxes, sheets.children, seen, work,
        )  # fmt: skip

    run_chunks(look, len(cells), chunks_per_thread=max(4, len(cells)), tell=tell)
    return seen, work[:, 0]
