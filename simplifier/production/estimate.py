"""What a run of a command will need, from a file that is not read yet or from a mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.checks import as_path, check_flag, check_kind
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.solid import grid_shape
from simplifier.io.load import claim_of
from simplifier.memory.limit import check_need
from simplifier.memory.need import MemoryNeed, MeshSize
from simplifier.memory.runs import (
    Judging,
    drawing,
    judging,
    loading,
    showing,
    simplifying,
    size_of,
    solidifying,
)
from simplifier.options.simplify import EvaluateOptions, SimplifyOptions
from simplifier.options.stages import Options, stage_options

Chosen = SimplifyOptions | EvaluateOptions


def judging_of(chosen: Chosen) -> Judging:
    """What of a run's measure memory depends on; all levels that are asked for may be kept."""
    levels = chosen.levels if isinstance(chosen, SimplifyOptions) else None
    count = 1 if levels is None else levels.lods or len(levels.error_bounds or ())
    return Judging(chosen.views, chosen.image, count, again=count > 1)


def estimate_memory(
    mesh: TriangleMesh | str | Path,
    chosen: Chosen | None = None,
    *,
    pictures: bool = False,
    viewing: bool = False,
) -> MemoryNeed:
    """What ``occluder simplify`` or ``occluder evaluate``, by the kind of ``chosen``, will need.

    ``mesh``      a mesh, or a file, of which only what it claims to hold is read.  A file does not
                  tell how wide and high the grid is, so that of a rod is assumed: the least.
    ``pictures``  whether they are drawn as well; ``viewing``: whether the mesh is saved to look at.

    ``gib`` of the result is the peak of the whole process and ``largest`` the stage that has it.
    Raises :class:`~simplifier.errors.UnknownFormatError`, and :class:`OptionError` for options that
    do not fit the mesh.
    """
    chosen = SimplifyOptions() if chosen is None else chosen
    _check_chosen("chosen", chosen)
    check_flag("pictures", pictures)
    check_flag("viewing", viewing)
    if isinstance(mesh, TriangleMesh):
        options = stage_options(chosen, float(mesh.extent.max()))
        return _need(size_of(mesh), mesh.extent, chosen, options, pictures, viewing)
    claim = claim_of(as_path("mesh", mesh))
    size = MeshSize(claim.vertices, claim.triangles)
    reading = loading(claim.vertices, claim.triangles, claim.decoding)
    rod = np.array([1.0, 0.0, 0.0])
    known = stage_options(_without_lengths(chosen), 1.0)
    return reading.joined(_need(size, rod, chosen, known, pictures, viewing))


def check_file(
    path: str | Path, options: Chosen, *, pictures: bool = False, viewing: bool = False
) -> None:
    """Raise :class:`~simplifier.errors.MemoryLimitError` for a file that the options' run would
    need too much memory for, whatever the shape of its grid."""
    _check_chosen("options", options)
    need = estimate_memory(as_path("path", path), options, pictures=pictures, viewing=viewing)
    check_need(need, options.memory_limit, where=str(path))


def _check_chosen(name: str, chosen: Chosen) -> None:
    kinds = SimplifyOptions | EvaluateOptions
    check_kind(name, chosen, kinds, "simplifier.SimplifyOptions or EvaluateOptions")


def _need(
    size: MeshSize, extent: FloatArray, chosen: Chosen, options: Options, drawn: bool, shown: bool
) -> MemoryNeed:
    cell_size = float(extent.max()) / options.solid.resolution
    shape = grid_shape(extent, options.solid.resolution)
    how = judging_of(chosen)
    if isinstance(chosen, EvaluateOptions):
        need = solidifying(size, shape, cell_size, options)
    else:
        need = simplifying(size, shape, cell_size, options, how)
    need = need.joined(judging(size, shape, options, how))
    if drawn:
        need = need.joined(drawing(size, shape, options))
    return need.joined(showing(size)) if shown else need


def _without_lengths(chosen: Chosen) -> Chosen:
    """Lengths mean nothing without a mesh: the coarsest grid, and no hole to close."""
    if isinstance(chosen, EvaluateOptions):
        return replace(chosen, smallest_hole=0.0)
    free = replace(
        chosen, smallest_hole=0.0, shrink=0.0, error_bound=None, error_bounds=None, lods=None,
        pixel_error=None, screen_height=None, fov=None,
        conservative=chosen.wholly_inside,
    )  # fmt: skip
    by_length = chosen.error_bound is not None or chosen.error_bounds is not None
    return replace(free, resolution=1) if by_length else free
