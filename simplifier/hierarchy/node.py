"""Triangles below a node -> its occluder, with an error that is proved (section 5 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from simplifier.evaluation.deviation import SLACK, deviation
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.hierarchy.options import SceneOptions
from simplifier.kernels.polygon_views import score_images
from simplifier.options import MOST_VOXELS, Axis, Options, SectionOptions, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Cancel
from simplifier.selection.measure import fitted_projections, silhouettes

Kind = Literal["near", "far", "inner"]
"""Of a leaf's two occluders: exact, and cheaper with an error; or that of an inner node."""

_SECTIONS = SectionOptions(directions=8, depths=3)
_VIEWS = 40  # that the search looks from; a scene has thousands of nodes
_NEAR_EFFORT = 2  # times the moves: drawn from near by, and for all instances of its mesh
_FINER = 2  # times the voxels of what keeps wholly inside: it loses up to one on every side
_ITSELF = 4  # times the budget: with fewer triangles a mesh is its own exact occluder
_MEASURED_VIEWS = 16
_IMAGE = 64  # pixels of a picture to measure, with a frame of one


@dataclass(frozen=True)
class Summary:
    """What a tree has to know of an occluder without reading it.

    ``triangles``    0 where it would hide nothing.
    ``error_bound``  proved, in the occluder's own space.
    ``radius``       see :func:`hiding_radius`.
    """

    triangles: int
    error_bound: float
    radius: float

    @classmethod
    def of(cls, occluder: Occluder) -> Summary:
        return cls(len(occluder.faces), occluder.error_bound, hiding_radius(occluder))


@dataclass(frozen=True)
class Stand:
    """How the triangles below a node stand: ``ground`` closes their low end along ``up``."""

    up: Axis
    ground: bool


def node_occluder(
    mesh: TriangleMesh,
    kind: Kind,
    stand: Stand,
    options: SceneOptions,
    cancel: Cancel | None = None,
) -> Occluder:
    """The occluder of the triangles below a node; without faces if it would hide nothing.

    The *near* one of a leaf is exact, so it can be drawn from anywhere: the triangles themselves if
    they are few, else an occluder that keeps wholly inside.  The *far* one has fewer triangles and
    an error.  An inner node's is made after one dilation step, which glues neighbours together.

    ``error_bound`` is what was measured and is proved: no point of the occluder is further from the
    triangles or from the interior that they enclose.  Raises
    :class:`~simplifier.errors.CancelledError`.
    """
    if kind == "near" and is_own_occluder(mesh, options):
        return _worth(Occluder(mesh.vertices, mesh.faces, 0.0), mesh, options.resolution)
    result = simplify_mesh(mesh, _options(mesh, kind, stand, options), cancel=cancel)
    made = result.occluder
    proved = made.error_bound
    if proved > 0.0:
        strays = deviation(made, mesh, result.solid.touched, result.solid.filled)
        proved = min(proved, strays + SLACK * result.solid.core.cell_size)
    exact = Occluder(made.vertices, made.faces, proved)
    return _worth(exact, mesh, options.resolution)


def is_own_occluder(mesh: TriangleMesh, options: SceneOptions) -> bool:
    """Whether a mesh has so few triangles that no other exact occluder is worth making."""
    return len(mesh.faces) <= _ITSELF * options.budget


def hiding_radius(occluder: Occluder) -> float:
    """Radius of the disc that hides as much, in the mean over all directions; 0 without faces.

    From the total occlusion measure M by M = pi R^3 / 3 (section 3 of the paper).
    """
    if len(occluder.faces) == 0:
        return 0.0
    points = occluder.vertices
    axes = image_axes(hemisphere_directions(_MEASURED_VIEWS))
    projections = fitted_projections(axes, points, 0.0)
    images = silhouettes(points, occluder.faces, projections)
    pixels = 1.0 / np.linalg.norm(projections[:, 0, :3], axis=1)
    measures = [
        float(score_images(image.reshape(1, _IMAGE))) / 2.0 * pixel**3
        for image, pixel in zip(images, pixels, strict=True)
    ]
    return float(np.cbrt(3.0 * np.mean(measures) / np.pi))


def _options(mesh: TriangleMesh, kind: Kind, stand: Stand, options: SceneOptions) -> Options:
    longest = float(mesh.extent.max())
    resolution = options.resolution
    if kind == "near":
        resolution = min(_FINER * resolution, MOST_VOXELS)
    made = make_options(
        longest, budget=options.budget, resolution=resolution, up=stand.up,
        ground=stand.ground, smallest_hole=min(options.smallest_hole, longest),
        conservative=options.conservative or kind == "near", preset="draft", seed=options.seed,
        moves=options.moves * (_NEAR_EFFORT if kind == "near" else 1),
    )  # fmt: skip
    return replace(
        made,
        solid=replace(made.solid, glue=kind == "inner"),
        sections=_SECTIONS,
        refine=replace(made.refine, views=_VIEWS, searches=1),
    )


def _worth(occluder: Occluder, mesh: TriangleMesh, resolution: int) -> Occluder:
    """The occluder, or none where it hides less than a disc of a voxel's radius."""
    voxel = float(mesh.extent.max()) / resolution
    if hiding_radius(occluder) >= voxel:
        return occluder
    return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), occluder.error_bound)
