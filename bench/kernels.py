"""Kernels one by one, on one core, beside a floor that nothing on this machine goes below.

A floor is bytes over bandwidth, or operations over rate, both measured in the same run
(:mod:`bench.rates`); ``times_floor`` is how far the kernel is from it.  Peers run on the same
distinct images in the same run; ``peer_ratio`` is the peer's time over ours.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from unittest.mock import patch

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from bench.meshes import bumpy_sphere
from bench.rates import bytes_a_second, lookups_a_second, seconds, word_operations_a_second
from bench.record import Row
from examples.castle import castle
from simplifier.accuracy.accuracy import view_masks
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import image_axes, random_directions
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.fill import flood
from simplifier.kernels.measure import score_images
from simplifier.kernels.soup_views import UNIT
from simplifier.kernels.voxelize import mark_triangles
from simplifier.options.stages import SectionOptions, make_options
from simplifier.pipeline import cut_solid
from simplifier.progress import Deadline, Stopwatch
from simplifier.refinement.annealing import Annealing, Prices, RefineViews, by_looks
from simplifier.refinement.search import pull_into
from simplifier.selection.measure import directional_measures, search_projections, silhouettes
from simplifier.slicing.planes import plan_sections
from simplifier.slicing.sampler import GridSampler
from simplifier.steps.solid import solidify
from simplifier.voxel.fill import fill
from simplifier.voxel.room import coarse_room
from simplifier.voxel.voxelize import voxelize

Masks = NDArray[np.bool_]


def kernel_times(repeats: int) -> Iterator[Row]:
    """One row a kernel and peer; each timing is a median of its own, ``repeats`` is not used."""
    del repeats
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with patch.dict(os.environ, OCCLUDER_THREADS="1"):
            for rows in (
                _marking, _flooding, _slicing, _coverage, _bit_measure, _exact_measure,
                _annealing,
            ):  # fmt: skip
                yield from rows()
    finally:
        cv2.setNumThreads(threads)


def _marking() -> Iterator[Row]:
    mesh = bumpy_sphere(1_000_000)
    grid = voxelize(mesh, 64)
    touched, count, scale = np.zeros(grid.shape, np.bool_), len(mesh.faces), 1.0 / grid.cell_size
    took = seconds(
        lambda: mark_triangles(
            mesh.vertices, mesh.faces, grid.origin, scale, 0, count, touched
        ),
        lambda: touched.fill(False),
    )  # fmt: skip
    size = mesh.vertices.nbytes + mesh.faces.nbytes
    floor = size / bytes_a_second(size)
    yield _row("mark_triangles", "triangle", count, took, floor, "read vertices and faces once")


def _flooding() -> Iterator[Row]:
    touched = voxelize(bumpy_sphere(100_000), 256)
    free = np.ones((256, 256, 256), np.bool_)
    free[tuple(slice(n) for n in touched.shape)] = ~touched.inside
    seeds = free.copy()
    seeds[1:-1, 1:-1, 1:-1] = False
    words, first = _packed(free), _packed(seeds)
    reached = first.copy()
    took = seconds(lambda: flood(words, reached), lambda: np.copyto(reached, first))
    size = 3 * words.nbytes
    floor = size / bytes_a_second(size)
    text = "read a bit of free, read and write a bit of reached"
    yield _row("flood", "voxel", free.size, took, floor, text)


def _slicing() -> Iterator[Row]:
    solid = fill(voxelize(bumpy_sphere(100_000), 64))
    plan = plan_sections(solid, SectionOptions())
    sampler = GridSampler(solid)
    # The slices of a full grid are exactly the pixels that the kernel looks at.
    full = GridSampler(solid.with_inside(np.ones(solid.shape, np.bool_)))
    pixels = int(full.areas(plan).sum())
    took = seconds(lambda: sampler.areas(plan))
    table = np.pad(solid.inside, 1).view(np.uint8).ravel()
    along = [np.linspace(1, n, 4096).astype(np.int64) for n in solid.shape]  # a diagonal
    places = np.ravel_multi_index(along, tuple(n + 2 for n in solid.shape))
    floor = pixels / lookups_a_second(table, places)
    yield _row("slice_areas", "pixel", pixels, took, floor, "look one voxel up, its place known")


def _coverage() -> Iterator[Row]:
    mesh, views = bumpy_sphere(100_000), 64
    projections = np.full((views, 2, 4), 128.0)
    projections[:, :, :3] = image_axes(random_directions(views, 0))[:, :2] * 100.0
    took = seconds(lambda: coverage_masks(mesh.vertices, mesh.faces, projections, 256, 256))
    size = mesh.vertices.nbytes + mesh.faces.nbytes + 12 * len(mesh.faces)
    floor = views * size / bytes_a_second(size)
    text = "read vertices, faces and three 4-byte cells a triangle in every view"
    yield _row("coverage", "triangle and view", views * len(mesh.faces), took, floor, text)


def _bit_measure() -> Iterator[Row]:
    masks = _views_of_castle(512, 64)
    images = np.packbits(masks, axis=2, bitorder="little").view("<u8")[..., 0].astype(np.uint64)
    took = seconds(lambda: score_images(images))
    # An erosion takes two shifts, four ANDs (or as many), a count and a sum in each of 64 rows;
    # there are about as many as the distance of the innermost pixel.
    erosions = sum(float(_cv2_distances(mask, cv2.DIST_MASK_PRECISE).max()) for mask in masks)
    floor = erosions * 64.0 * 8.0 / word_operations_a_second()
    text = "erosions x 64 rows x 8 word operations"
    for name, peer in _peers(masks):
        yield _row("measure_twice", "image of 64 x 64", len(masks), took, floor, text, name, peer)


def _exact_measure() -> Iterator[Row]:
    masks = _views_of_castle(128, 128)
    took = seconds(lambda: directional_measures(masks))
    # A byte read; a distance of eight bytes written and read, and again by the second pass.
    size = masks[0].size * 8
    floor = masks.size * 33.0 / bytes_a_second(2 * size)
    text = "33 bytes a pixel: the mask, and its distances written and read twice"
    for name, peer in _peers(masks):
        yield _row("distance_sum", "image of 128 x 128", len(masks), took, floor, text, name, peer)


def _annealing() -> Iterator[Row]:
    """The inner loop of refinement, on the castle at 64 voxels and 64 triangles."""
    mesh = castle()
    options = make_options(float(mesh.extent.max()), ground=True)
    watch = Stopwatch()
    solid = solidify(mesh, options.solid, watch)
    start = cut_solid(mesh, solid, options, watch, Deadline.after(None))
    room = coarse_room(solid.core, solid.reach)
    margin = room.margin
    projections = by_looks(search_projections(solid, options, options.refine.views, margin))
    originals = silhouettes(solid.core.to_grid(mesh.vertices) + margin, mesh.faces, projections)
    search = Annealing(
        pull_into(start + margin, room), room, RefineViews(projections, originals),
        Prices(UNIT // 2), 0,
    )  # fmt: skip
    search.run(6_000, (0.0, 0.5))
    before, calls = search.work.copy(), 0

    def run() -> None:
        nonlocal calls
        calls += 1
        search.run(1_200, (0.5, 0.5))

    took = seconds(run)
    drawn, scored = (search.work - before) / calls
    masks = np.unpackbits(originals.view(np.uint8), bitorder="little").reshape(-1, 64, 64) > 0
    deepest = [float(_cv2_distances(mask, cv2.DIST_MASK_PRECISE).max()) for mask in masks]
    # Drawn: three edges over half the rows, four operations each, then five a row to compare.
    # Scored: the union and its part within the original, eroded as for the measure.
    operations = drawn * 64.0 * (6.0 + 5.0) + scored * 2.0 * float(np.mean(deepest)) * 64.0 * 8.0
    text = f"64 rows x 11 word operations drawn, and for the {scored / drawn:.0%} scored 2 measures"
    floor = operations / word_operations_a_second()
    yield _row("anneal", "view of a move", round(drawn), took, floor, text)


def _views_of_castle(count: int, size: int) -> Masks:
    """Distinct images: repeating one flatters branches."""
    nothing = Occluder(np.empty((0, 3)), np.empty((0, 3), np.int32))
    return view_masks(castle(), nothing, random_directions(count, 1), size)[0]


def _peers(masks: Masks) -> Iterator[tuple[str, float]]:
    """Name and seconds of distance transforms summed over all images."""
    some = masks[:: max(len(masks) // 64, 1)]
    framed = np.pad(masks, ((0, 0), (1, 1), (1, 1))).astype(np.uint8)

    def opencv(size: int) -> Callable[[], object]:
        return lambda: [cv2.distanceTransform(m, cv2.DIST_L2, size).sum() for m in framed]

    yield "cv2 precise", seconds(opencv(cv2.DIST_MASK_PRECISE))
    yield "cv2 5 x 5", seconds(opencv(cv2.DIST_MASK_5))
    scipy = seconds(lambda: [ndimage.distance_transform_edt(np.pad(m, 1)).sum() for m in some])
    yield "scipy exact", scipy * len(masks) / len(some)


def _cv2_distances(mask: NDArray[np.bool_], size: int) -> NDArray[np.float32]:
    framed = np.pad(mask, 1).astype(np.uint8)
    return np.asarray(cv2.distanceTransform(framed, cv2.DIST_L2, size))


def _row(
    name: str, unit: str, count: int, took: float, floor: float, text: str,
    peer: str = "", peer_took: float | None = None,
) -> Row:  # fmt: skip
    return {
        "kernel": name, "unit": unit, "units": count, "ns": 1e9 * took / count,
        "floor_ns": 1e9 * floor / count, "times_floor": took / floor, "floor": text, "peer": peer,
        "peer_ns": None if peer_took is None else 1e9 * peer_took / count,
        "peer_ratio": None if peer_took is None else peer_took / took,
    }  # fmt: skip


def _packed(voxels: Masks) -> NDArray[np.uint64]:
    """(nx, ny, 64 k) bool to bit words, as the flood takes them."""
    return np.packbits(voxels, axis=2, bitorder="little").view("<u8").astype(np.uint64)
