"""The report of a fixed occluder against views, pixels and quads.

views   the first so many of 4 x 4096 random views, all quads counted, against all of them.  The
        groups share no view, so each is a report with a seed of its own.
image   16 views for each of eight seeds, all quads counted, against the same views at 2048 pixels;
        the deviation is that of all 128 views together.
quads   256 views, the same for all seeds, against all quads counted.
as it is   ``simplifier.evaluate`` with its defaults and 24 seeds, against all views of the first;
        what a user sees.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

import simplifier
from bench.stability.convergence.curve import Curve, curves, together
from bench.stability.convergence.subjects import Subject
from simplifier.accuracy.accuracy import AccuracyOptions, AccuracyReport, evaluate_accuracy
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import random_directions

FIGURES = ("recall", "precision")
DEFAULTS = AccuracyOptions()
DEFAULT_VALUES = {"views": DEFAULTS.views, "image": DEFAULTS.image, "quads": DEFAULTS.quads}

_SEEDS, _AS_IT_IS = 8, 24
_POOL_SEEDS, _POOL = range(100, 104), 4096
_VIEWS = (16, 32, 64, 128, 256, 512, 1024, 2048, 4096)
_IMAGES, _FINEST = (32, 64, 128, 256, 512, 1024), 2048
_IMAGE_VIEWS = 16
_QUADS = (2_000, 8_000, 32_000, 128_000)


def report_curves(subject: Subject) -> Iterator[Curve]:
    """Recall and precision against each knob."""
    occluder = simplifier.simplify(subject.mesh, **subject.options).occluder
    pools = [_exact(subject, occluder, _POOL, seed) for seed in _POOL_SEEDS]
    pixels = np.stack([pixels_of(report) for report in pools])
    yield from view_curves(subject.name, pixels, _VIEWS)
    yield from _image_curves(subject, occluder)
    yield from _quad_curves(subject, occluder)
    yield from _default_curves(subject, occluder, shares(pixels.reshape(-1, 3)))


def view_curves(mesh: str, pixels: FloatArray, counts: tuple[int, ...]) -> list[Curve]:
    """``pixels`` (seeds, views, 3) of independent views, hidden rightly, missed and wrongly."""
    every = shares(pixels.reshape(-1, 3))
    found: dict[str, dict[int, list[float]]] = {figure: {} for figure in FIGURES}
    for count in counts:
        groups = [shares(group) for group in pixels.reshape(-1, count, 3)]
        for figure in FIGURES:
            found[figure][count] = [group[figure] - every[figure] for group in groups]
    return curves(mesh, "views", DEFAULTS.views, found)


def pixels_of(report: AccuracyReport) -> FloatArray:
    """(V, 3): hidden rightly, missed and hidden wrongly."""
    return np.stack([report.nt, report.pf, report.nf], axis=1)


def shares(pixels: FloatArray) -> dict[str, float]:
    """Recall and precision of views (V, 3), from sums as the report has them."""
    right, missed, wrong = pixels.sum(axis=0)
    return {"recall": float(right / (right + missed)), "precision": float(right / (right + wrong))}


def _exact(subject: Subject, occluder: Occluder, views: int, seed: int) -> AccuracyReport:
    options = AccuracyOptions(views, seed=seed, exact=True)
    return evaluate_accuracy(subject.mesh, occluder, options)


def _image_curves(subject: Subject, occluder: Occluder) -> list[Curve]:
    found: dict[str, dict[int, list[float]]] = {
        figure: {image: [] for image in _IMAGES} for figure in FIGURES
    }
    for seed in range(_SEEDS):
        options = AccuracyOptions(_IMAGE_VIEWS, _FINEST, seed=seed, exact=True)
        finest = evaluate_accuracy(subject.mesh, occluder, options)
        for image in _IMAGES:
            coarse = evaluate_accuracy(subject.mesh, occluder, replace(options, image=image))
            _add(found, image, coarse, finest)
    return [together(one) for one in curves(subject.name, "image", DEFAULTS.image, found)]


def _quad_curves(subject: Subject, occluder: Occluder) -> list[Curve]:
    lines = random_directions(DEFAULTS.views, 0)
    whole = replace(DEFAULTS, exact=True)
    every = evaluate_accuracy(subject.mesh, occluder, whole, directions=lines)
    found: dict[str, dict[int, list[float]]] = {
        figure: {quads: [] for quads in _QUADS} for figure in FIGURES
    }
    for quads in _QUADS:
        for seed in range(_SEEDS):
            options = replace(DEFAULTS, quads=quads, seed=seed)
            sample = evaluate_accuracy(subject.mesh, occluder, options, directions=lines)
            _add(found, quads, sample, every)
    return curves(subject.name, "quads", DEFAULTS.quads, found)


def _default_curves(
    subject: Subject, occluder: Occluder, every: Mapping[str, float]
) -> list[Curve]:
    """One value alone: the report as it is, against what endless views of that size would say."""
    reports = [
        simplifier.evaluate(subject.mesh, occluder, seed=seed).accuracy for seed in range(_AS_IT_IS)
    ]
    found = {
        figure: {DEFAULTS.views: [getattr(report, figure) - every[figure] for report in reports]}
        for figure in FIGURES
    }
    return curves(subject.name, "as it is", DEFAULTS.views, found)


def _add(
    found: dict[str, dict[int, list[float]]],
    value: int,
    report: AccuracyReport,
    reference: AccuracyReport,
) -> None:
    for figure in FIGURES:
        found[figure][value].append(getattr(report, figure) - getattr(reference, figure))
