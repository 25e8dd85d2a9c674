"""The two slicers side by side on every asset: every pixel of every plane, and what comes of it.

A pixel whose centre lies within 0.01 voxel of a voxel's face may go either way (the contract of
:class:`simplifier.slicing.sections.Slicer`); how many of those that differ do is told.  Of slices
of one bin the largest is kept, so a pixel can change which.  Recall is judged by 256 views, all
quads counted.  Where the two give different occluders, ``recall_deviation`` is the scatter of
recall over five seeds of the search by one and the same slicer: what any change may bring.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import simplifier
from bench.meshes import readable_assets
from bench.record import Row
from bench.stability.convergence.spread import Spread
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracies
from simplifier.errors import OccluderError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.section import ImageFrame
from simplifier.geometry.solid import BoolArray, VoxelGrid
from simplifier.options.simplify import Slicing
from simplifier.options.stages import SectionOptions, make_options
from simplifier.progress import Stopwatch
from simplifier.slicing.planes import SamplingPlan, plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import Slicer, best_sections
from simplifier.slicing.stencil import StencilSlicer
from simplifier.steps.solid import solidify
from simplifier.voxel.surface import voxel_mesh

_SLICERS: tuple[Slicing, ...] = ("cpu", "gl")
_NEAR = 0.01  # voxels from a voxel's face
_SEEDS = 5
_BLOCK = 256  # planes whose masks are held at once


@dataclass(frozen=True)
class Difference:
    """What two slicers say of the planes of one plan.

    ``covered``  pixels of the first; ``pixels`` that differ, ``near`` of them at a voxel's face;
    ``planes`` with such a pixel; ``sections`` chosen by one and not the other, or other pixels.
    """

    covered: int
    pixels: int
    near: int
    planes: int
    sections: int


def slicer_rows(paths: list[Path] | None = None) -> Iterator[Row]:
    """A row an asset; raises :class:`~simplifier.errors.BackendUnavailableError` without OpenGL."""
    for path, standing in readable_assets(paths):
        try:
            mesh = simplifier.load(path)
            yield _row(path.stem, mesh, standing)
        except OccluderError as error:
            yield {"mesh": path.stem, "note": f"refused: {error}"}


def _row(name: str, mesh: TriangleMesh, standing: dict[str, Any]) -> Row:
    options = make_options(float(mesh.extent.max()), **standing)
    grid = solidify(mesh, options.solid, Stopwatch()).core
    difference = compared(grid, options.sections)
    occluders = [
        simplifier.simplify(mesh, slicer=slicer, **standing).occluder for slicer in _SLICERS
    ]
    same = all(
        np.array_equal(getattr(occluders[0], part), getattr(occluders[1], part))
        for part in ("vertices", "faces")
    )
    cpu, gl = evaluate_accuracies(mesh, occluders, AccuracyOptions(exact=True))
    scatter = None if same else _recall_over_seeds(mesh, standing).deviation
    return {
        "mesh": name, "planes": len(plan_sections(grid, options.sections)),
        "covered_pixels": difference.covered, "pixels_differ": difference.pixels,
        "at_a_face": difference.near, "planes_differ": difference.planes,
        "sections_differ": difference.sections, "recall_cpu": 100.0 * cpu.recall,
        "recall_gl": 100.0 * gl.recall, "recall_difference": 100.0 * (gl.recall - cpu.recall),
        "same_occluder": "yes" if same else "no", "recall_deviation": scatter,
    }  # fmt: skip


def _recall_over_seeds(mesh: TriangleMesh, standing: dict[str, Any]) -> Spread:
    occluders = [
        simplifier.simplify(mesh, seed=seed, **standing).occluder for seed in range(_SEEDS)
    ]
    reports = evaluate_accuracies(mesh, occluders, AccuracyOptions(exact=True))
    return Spread.of([100.0 * report.recall for report in reports])


def compared(grid: VoxelGrid, options: SectionOptions) -> Difference:
    """Both slicers on the whole plan."""
    plan, sampler = plan_sections(grid, options), GridSampler(grid)
    vertices, faces = voxel_mesh(grid)
    covered = pixels = near = planes = 0
    with StencilSlicer(vertices, faces, grid.shape) as stencil:
        for first in range(0, len(plan), _BLOCK):
            block = np.arange(first, min(first + _BLOCK, len(plan)))
            pairs = zip(sampler.masks(plan, block), stencil.masks(plan, block), strict=True)
            for index, (sampled, drawn) in zip(block.tolist(), pairs, strict=True):
                differs = sampled != drawn
                covered += int(np.count_nonzero(sampled))
                pixels += int(np.count_nonzero(differs))
                near += _at_a_face(differs, plan.frames[plan.frame_of[index]], plan.depths[index])
                planes += int(differs.any())
        sections = _other_sections(plan, sampler, stencil)
    return Difference(covered, pixels, near, planes, sections)


def _at_a_face(differs: BoolArray, frame: ImageFrame, depth: float) -> int:
    """How many of those pixels have their centre within 0.01 voxel of a voxel's face."""
    rows, columns = np.nonzero(differs)
    place = frame.corner + frame.pixel * (np.stack([columns, rows], axis=1) + 0.5)
    points = place @ frame.axes[:2] + depth * frame.axes[2]
    return int(np.count_nonzero((np.abs(points - np.round(points)) < _NEAR).any(axis=1)))


def _other_sections(plan: SamplingPlan, one: Slicer, other: Slicer) -> int:
    """Sections of either that the other has not, pixel by pixel; a changed one counts once."""
    chosen = [
        {
            (section.plane.depth, section.plane.axes.tobytes(), section.mask.tobytes())
            for section in best_sections(plan, slicer)
        }
        for slicer in (one, other)
    ]
    return max(len(chosen[0] - chosen[1]), len(chosen[1] - chosen[0]))
