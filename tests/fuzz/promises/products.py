"""What was made of a mesh, against the mesh itself and by other means than the library's own."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from simplifier import EvaluateOptions, SimplifyOptions, evaluate, save, simplify
from simplifier.accuracy.accuracy import AccuracyReport, view_masks
from simplifier.errors import OutputError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Level, Occluder
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import random_directions
from simplifier.io.load import load_occluder
from simplifier.lods.levels import Levels
from simplifier.production.result import MeasuredResult
from tests.fuzz.cases import Case, mesh_of
from tests.fuzz.promises import check_sentence, promise
from tests.fuzz.promises.distances import surface_distances, voxel_distances
from tests.fuzz.promises.mesh_files import check_levels, check_occluder, check_round_trips
from tests.fuzz.promises.soups import check_soup, is_closed
from tests.schema import check_report

_SLACK = 1e-6  # voxels: what rounding may take
_SAMPLES = 8  # points a triangle
_VIEWS, _IMAGE = 24, 48


def check_simplify(case: Case, folder: Path) -> None:
    """Raises ``OccluderError`` for a mesh or options that are refused."""
    mesh = mesh_of(case["mesh"])
    check_soup(mesh.vertices, mesh.faces)
    options = SimplifyOptions.of(case["options"])
    product = simplify(mesh, options).measure()
    solid = product.result.made.solid
    for level, budget in zip(product.levels, _budgets(product), strict=True):
        _check_made(level, mesh, budget)
    _check_reach(product.levels[0], mesh, solid)
    _check_accuracy(product.accuracies[0])
    if solid.wholly_inside and is_closed(mesh.vertices, mesh.faces) and not _closes_holes(solid):
        _check_nothing_hidden_wrongly(mesh, product.occluder)
    promise(len(product.occluder.faces) > 0 or product.warnings, "nothing comes with a reason")
    for warning in product.warnings:
        check_sentence(warning)
    _check_report(product.report())
    _check_files(product, folder)
    if options.time_limit is None:
        with _threads(3):
            _check_same(product.occluder, simplify(mesh, options).measure().occluder)


def check_evaluate(case: Case) -> None:
    """As the library does it: any soup is judged, and what cannot be is refused."""
    mesh, other = mesh_of(case["mesh"]), mesh_of(case["occluder"])
    options = EvaluateOptions.of(case["options"])
    found = evaluate(mesh, Occluder(other.vertices, other.faces), options)
    _check_accuracy(found.accuracy)
    _check_report(found.report())
    again = evaluate(mesh, Occluder(other.vertices, other.faces), options)
    promise(again.accuracy.precision == found.accuracy.precision, "same mesh, same precision")
    own = evaluate(mesh, Occluder(mesh.vertices, mesh.faces), options).accuracy
    promise(own.precision == own.recall == 1.0, "a mesh hides just what it hides")


def _budgets(product: MeasuredResult) -> list[int]:
    result, budget = product.result.made, product.result.options.budget
    if isinstance(result, Levels):
        return [budget] * len(product.levels)
    return [budget]


def _check_made(level: Level, mesh: TriangleMesh, budget: int) -> None:
    occluder = level.occluder
    check_occluder(occluder)
    promise(len(occluder.faces) <= budget, "an occluder keeps to its budget")
    corners = np.sort(occluder.faces, axis=1)
    promise(len(np.unique(corners, axis=0)) == len(corners), "no triangle is there twice")
    places = np.unique(occluder.vertices, axis=0)
    promise(len(places) == len(occluder.vertices), "no vertex is there twice")
    promise(occluder.error_bound < math.inf, "what was made has an error bound")
    slack = 1e-9 * float(np.abs(mesh.bounds).max())
    promise(level.deviation <= occluder.error_bound + slack, "a deviation keeps to the bound")
    check_round_trips(occluder)


def _check_reach(level: Level, mesh: TriangleMesh, solid: Solid) -> None:
    """Points all over the occluder are no further out than was promised, and than was measured."""
    grid, inner = solid.filled, solid.interior
    if len(level.occluder.faces) == 0:
        return
    points = grid.to_grid(_spread(level.occluder.vertices[level.occluder.faces]))
    surface = grid.to_grid(mesh.vertices)[mesh.faces]
    finer = grid.cell_size / inner.cell_size
    away = surface_distances(points, surface)
    # To grid space and back: coordinates far from the origin have fewer digits left.
    slack = _SLACK + 16.0 * np.finfo(float).eps * float(np.abs(mesh.bounds).max()) / grid.cell_size
    bound, measured = level.error_bound / grid.cell_size, level.deviation / grid.cell_size
    out = away > min(bound, measured + 0.25) + slack  # the others need no look, which takes long
    away[out] = np.minimum(away[out], _away_from(inner.inside, points[out] * finer) / finer)
    furthest = float(away.max())
    promise(furthest <= bound + slack, f"{furthest} voxels out, where {bound} were promised")
    promise(furthest <= measured + 0.25 + slack, f"{furthest} voxels out, {measured} measured")


def _away_from(inside: NDArray[np.bool_], points: FloatArray) -> FloatArray:
    """(n,) from each of ``points`` (n, 3) to the nearest voxel that is inside: those of the shell,
    since there may be millions behind them."""
    cells = np.floor(points).astype(np.int64)
    there = ((cells >= 0) & (cells < inside.shape)).all(axis=1)
    away = np.zeros(len(points))
    out = ~there
    out[there] = ~inside[tuple(cells[there].T)]
    shell = np.argwhere(inside & ~binary_erosion(inside))
    away[out] = voxel_distances(points[out], shell)
    return away


def _spread(triangles: FloatArray) -> FloatArray:
    """(n, 3) the corners, and points in between."""
    weights = np.random.default_rng(0).dirichlet(np.ones(3), _SAMPLES)
    inner = np.einsum("kc,mcx->mkx", weights, triangles).reshape(-1, 3)
    return np.concatenate([triangles.reshape(-1, 3), inner])


def _check_accuracy(report: AccuracyReport) -> None:
    for share in (report.precision, report.recall):
        promise(0.0 <= share <= 1.0, "precision and recall are shares")
    for shares in (report.precision_by_view, report.recall_by_view):
        promise(((shares >= 0.0) & (shares <= 1.0)).all(), "they are shares in every view")
    for pixels in (report.nt, report.pf, report.nf):
        promise((np.isfinite(pixels) & (pixels >= 0.0)).all(), "pixels are counted")


def _closes_holes(solid: Solid) -> bool:
    """Whether openings were called closed that are there, as through a ring."""
    return any(closing.by == "smallest_hole" and closing.voxels > 0 for closing in solid.closed_by)


def _check_nothing_hidden_wrongly(mesh: TriangleMesh, occluder: Occluder) -> None:
    original, hidden = view_masks(mesh, occluder, random_directions(_VIEWS, 7), _IMAGE)
    wrong = np.count_nonzero(hidden & ~original)
    promise(wrong == 0, f"{wrong} pixels are hidden that a closed mesh does not hide")


def _check_report(report: dict[str, Any]) -> None:
    check_report(json.loads(json.dumps(report, allow_nan=False)))
    promise(min(report["timings"].values()) >= 0.0, "no stage took less than no time")
    promise(report["triangles"] >= 0 and report["deviation"] >= 0.0, "a report counts")


def _check_files(product: MeasuredResult, folder: Path) -> None:
    """What is saved can be loaded, as many triangles as there were."""
    for suffix in (".glb", ".ply"):
        try:
            written = product.save(folder / f"made{suffix}")
        except OutputError as error:
            promise("32-bit" in error.what and suffix == ".glb", "anything can be saved as .ply")
            continue
        promise(load_occluder(written[0]).error_bound >= 0.0, "an occluder has an error bound")
    if isinstance(product.result.made, Levels):
        check_levels(product.chain)
    save(product.occluder, folder / "made.obj")


@contextmanager
def _threads(count: int) -> Iterator[None]:
    before = os.environ.get("OCCLUDER_THREADS", "")
    os.environ["OCCLUDER_THREADS"] = str(count)
    try:
        yield
    finally:
        os.environ["OCCLUDER_THREADS"] = before


def _check_same(one: Occluder, other: Occluder) -> None:
    same: NDArray[np.bool_] = np.array(
        [one.vertices.tobytes() == other.vertices.tobytes(),
         one.faces.tobytes() == other.faces.tobytes(),
         one.error_bound == other.error_bound]
    )  # fmt: skip
    promise(same.all(), "same mesh, same options, same bytes on any number of threads")
