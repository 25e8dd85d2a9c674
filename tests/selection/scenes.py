"""Candidates to select from: random stars in random planes, and the sections of a mesh."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.section import Plane
from simplifier.geometry.views import BoundingSphere, hemisphere_directions, image_axes
from simplifier.options.stages import TOLERANCE_VOXELS, SectionOptions
from simplifier.polygon.chain import simplification_chain
from simplifier.polygon.simplify import bridge_holes, simplify_polygon
from simplifier.selection.candidates import Candidates
from simplifier.slicing.loops import edge_loops
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.slicing.sections import best_sections
from simplifier.voxel.fill import fill
from simplifier.voxel.voxelize import voxelize
from tests.pictures import sphere_projections

BOX = 40.0
"""Edge of the cube that random scenes fill, in voxels."""


def star_chain(generator, corners, reach):
    """The chain of a random star-shaped polygon in a random plane through the cube."""
    # No gap reaches half a turn, so the ring is simple and counter-clockwise.
    angle = (np.arange(corners) + generator.uniform(0.3, 0.7, corners)) * 2.0 * np.pi / corners
    radius = generator.uniform(0.3, 1.0, corners) * reach
    axes = image_axes(_unit(generator.normal(size=(1, 3))))[0]
    centre = axes @ generator.uniform(0.2 * BOX, 0.8 * BOX, 3)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) + centre[:2]
    return simplification_chain(ring, Plane(axes, float(centre[2])))


def random_chains(seed, count, most_corners=14):
    generator = np.random.default_rng(seed)
    return [
        star_chain(generator, int(generator.integers(3, most_corners + 1)), reach)
        for reach in generator.uniform(3.0, 22.0, count)
    ]


def projections(views, centre=(BOX / 2.0,) * 3, radius=BOX * 0.87):
    axes = image_axes(hemisphere_directions(views))
    return sphere_projections(axes, np.asarray(centre), radius)


def random_candidates(seed, count, views=8, most_corners=14):
    return Candidates.from_chains(random_chains(seed, count, most_corners), projections(views))


def mesh_candidates(mesh, resolution, *, ground=False, views=48, sections=None):
    """What the pipeline chooses from, for a y-up mesh."""
    solid = fill(voxelize(mesh, resolution), frozenset({(1, 0)}) if ground else frozenset())
    found = best_sections(plan_sections(solid, sections or SectionOptions()), GridSampler(solid))
    chains = []
    for section in found:
        for polygon in edge_loops(section):
            simple = simplify_polygon(polygon, TOLERANCE_VOXELS)
            if simple is not None:
                chains.append(simplification_chain(bridge_holes(simple), section.plane))
    sphere = BoundingSphere.of(mesh)
    maps = projections(views, solid.to_grid(sphere.centre), sphere.radius / solid.cell_size)
    return Candidates.from_chains(chains, maps)


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
