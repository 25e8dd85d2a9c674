"""The two forms of the occlusion measure on every asset, and what they would choose.

512 even views of each mesh, framed as a search frames them, 64 x 64 pixels: the bit form (equation
1 by octagons) against the exact one (equation 3 by the distance transform).  ``scale`` is bit over
exact, view by view.

Then the greedy cut of the paper: at each step the 64 polygons that the bit form likes best are
measured by the exact form too, in the same 48 pictures.  ``other_choice`` counts the steps at which
the exact form likes another one better; ``worst_loss`` is what the choice by bits gives away then,
in points of the original's measure.
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
from simplifier.errors import OccluderError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.section import Chain
from simplifier.geometry.solid import Solid
from simplifier.kernels.coverage import unpack_masks
from simplifier.options.stages import TOLERANCE_VOXELS, Options, SectionOptions, make_options
from simplifier.polygon.chain import simplification_chain
from simplifier.polygon.simplify import bridge_holes, simplify_polygon
from simplifier.progress import Stopwatch
from simplifier.selection.candidates import Candidates, Images, score
from simplifier.selection.measure import (
    bit_measure,
    directional_measures,
    search_projections,
    silhouettes,
)
from simplifier.slicing.flats import flat_directions
from simplifier.slicing.loops import edge_loops
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import best_sections
from simplifier.steps.solid import solidify

_VIEWS = 512
_SIZE = 64
_STEPS = 12
_CONTENDERS = 64


@dataclass(frozen=True, eq=False)
class Forms:
    """(views,) of each form, in cubic pixels; views that show nothing are left out."""

    bits: FloatArray
    exact: FloatArray

    @property
    def correlation(self) -> float:
        return float(np.corrcoef(self.bits, self.exact)[0, 1])

    @property
    def scale(self) -> FloatArray:
        """Bit over exact."""
        return self.bits / self.exact


@dataclass(frozen=True)
class Choices:
    """Steps of a greedy cut, those with another choice, and the most that one gave away, points."""

    steps: int
    other: int
    worst_loss: float


def form_rows(paths: list[Path] | None = None) -> Iterator[Row]:
    """A row an asset; of one that is too thin to be seen, or refused, a note."""
    for path, standing in readable_assets(paths):
        try:
            yield form_row(path.stem, simplifier.load(path), standing)
        except OccluderError as error:
            yield {"mesh": path.stem, "note": f"refused: {error}"}


def form_row(name: str, mesh: TriangleMesh, standing: dict[str, Any]) -> Row:
    options = make_options(float(mesh.extent.max()), **standing)
    solid = solidify(mesh, options.solid, Stopwatch())
    forms = both_forms(pictures(mesh, solid, options, _VIEWS))
    if len(forms.bits) == 0:
        return {"mesh": name, "views": 0, "note": "covers no pixel of any view"}
    choices = compared_choices(mesh, solid, options)
    off = 100.0 * (forms.scale - 1.0)
    return {
        "mesh": name, "views": len(forms.bits), "correlation": f"{forms.correlation:.6f}",
        "scale_error": float(off.mean()), "scale_deviation": float(off.std(ddof=1)),
        "scale_least": float(off.min()), "scale_most": float(off.max()),
        "steps": choices.steps, "other_choice": choices.other, "worst_loss": choices.worst_loss,
    }  # fmt: skip


def pictures(mesh: TriangleMesh, solid: Solid, options: Options, views: int) -> Images:
    """(views, 64) bit images of the mesh, framed as a search frames them."""
    projections = search_projections(solid, options, views)
    return silhouettes(solid.core.to_grid(mesh.vertices), mesh.faces, projections)


def both_forms(images: Images) -> Forms:
    """Of bit images (views, 64)."""
    bits = np.array([bit_measure(image) for image in images])
    exact = exact_measures(images)
    seen = exact > 0.0
    return Forms(bits[seen], exact[seen])


def exact_measures(images: Images) -> FloatArray:
    """(views,) of bit images (views, 64)."""
    return directional_measures(unpack_masks(images[:, :, None], _SIZE))


def compared_choices(mesh: TriangleMesh, solid: Solid, options: Options) -> Choices:
    """Walk the cut that the bit form makes, and ask the exact one at every step."""
    views = options.selection.views
    chains = sections_of(mesh, solid, options.sections)
    candidates = Candidates.from_chains(chains, search_projections(solid, options, views))
    whole = float(exact_measures(pictures(mesh, solid, options, views)).sum())
    union, losses = candidates.nothing(), []
    polygons = np.arange(len(candidates), dtype=np.int32)
    for _ in range(_STEPS):
        scores = candidates.scores(polygons, candidates.triangles, union)
        order = np.argsort(-scores, kind="stable")[:_CONTENDERS]
        if len(order) == 0 or scores[order[0]] <= score(union) * (1.0 + options.selection.alpha):
            break
        drawn = [candidates.draw(int(i), int(candidates.triangles[i])) | union for i in order]
        exact = [float(exact_measures(images).sum()) for images in drawn]
        losses.append(100.0 * (max(exact) - exact[0]) / whole)
        union = drawn[0]
    other = sum(loss > 0.0 for loss in losses)
    return Choices(len(losses), other, max(losses, default=0.0))


def sections_of(mesh: TriangleMesh, solid: Solid, options: SectionOptions) -> list[Chain]:
    """The polygons that the pipeline chooses from."""
    chains = []
    for section in best_sections(
        plan_sections(solid.core, options, flat_directions(mesh)), GridSampler(solid.core)
    ):
        for polygon in edge_loops(section):
            simplified = simplify_polygon(polygon, TOLERANCE_VOXELS)
            if simplified is not None:
                chains.append(simplification_chain(bridge_holes(simplified), section.plane))
    return chains
