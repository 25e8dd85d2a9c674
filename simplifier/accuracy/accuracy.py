"""Precision and recall of an occluder over many views (paper section 6.1).

Views are orthographic, directions uniform on the sphere from a seeded generator (those that rise
are turned about where viewers are above), the image a square that spans the original's bounding
sphere, coverage by the pixel-centre rule.  In every view random quads are tested against both
silhouettes (:mod:`simplifier.accuracy.random_quads`), and

    precision = Nt / (Nt + Nf)        recall = Nt / (Nt + Pf)

with the sums taken over all views.  Precision is 1 when nothing was hidden at all (an occluder
without triangles), recall is 1 when nothing could be hidden (no quad fits in the original).  Quads
lie in the original's bounding box, so parts of the occluder beyond it, or beyond the image, cost
nothing here; the deviation tells them.

Expected pixels of random quads, view by view: sampled, or exact (paper section 6.1).

A quad is two corner pixels, each drawn on its own and uniformly from the original's screen bounding
box (the smallest pixel rectangle that holds the original's pixels); it covers the pixels from the
lesser to the greater in each axis, both included.  With full(mask) = the whole quad lies in it:

    Nt  pixels of quads with full(original) and full(occluder)
    Pf  pixels of quads with full(original) and not full(occluder)
    Nf  pixels outside the original of quads with full(occluder) and not full(original)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from simplifier.accuracy.silhouette_views import SilhouetteViews
from simplifier.accuracy.verdict import LEAST_COVERAGE
from simplifier.checks import check_kind, check_whole
from simplifier.device.device import PROCESSOR, Device, QuadSample
from simplifier.errors import OptionError
from simplifier.geometry.mesh import A_MESH, FloatArray, TriangleMesh
from simplifier.geometry.occluder import AN_OCCLUDER, Occluder
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.views import from_above, random_directions
from simplifier.kernels.coverage import unpack_masks
from simplifier.kernels.random_quads import exact_quad_pixels, full_areas, mean_quad_areas
from simplifier.options.fields import OptionSet, shared
from simplifier.options.simplify import Axis, SimplifyOptions, Viewers

QUANTILE_LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""The shares of views that the report's quantiles stand for."""


@dataclass(frozen=True)
class AccuracyOptions(OptionSet):
    """How accuracy is measured; two reports compare only when these are equal.

    ``views``  orthographic views.  More narrow the spread by the choice of directions.
    ``image``  pixels a side.  More resolve thinner parts; time and memory grow as its square.
    ``quads``  random quads a view.  More lessen the sampling noise; not used when ``exact``.
    ``seed``   of directions and quads.
    ``exact``  the expectation over all quads in place of a sample: no noise, about the same time.
    ``viewers``  where they can be: ``all``, or ``above``, looking level or down (d . up <= 0).
    ``up``     the mesh's up axis, for viewers above.

    Raises :class:`OptionError` for a value out of range or not known.
    """

    views: int = shared(SimplifyOptions, "views")
    image: int = shared(SimplifyOptions, "image")
    quads: int = shared(SimplifyOptions, "quads")
    seed: int = shared(SimplifyOptions, "seed")
    exact: bool = shared(SimplifyOptions, "exact")
    viewers: Viewers = shared(SimplifyOptions, "viewers")
    up: Axis = shared(SimplifyOptions, "up")


@dataclass(frozen=True, eq=False)
class AccuracyReport:
    """Precision and recall, over all views and view by view; fractions from 0 to 1.

    ``precision``, ``recall``  from the sums over all views.
    ``directions``             (V, 3) float64 unit vectors, the lines of sight.
    ``precision_by_view``, ``recall_by_view``  (V,) float64.
    ``nt``, ``pf``, ``nf``     (V,) float64: mean pixels a quad that are hidden rightly, missed, and
                               hidden wrongly.
    ``coverage``               how much there is to hide: of the pixels that random quads cover, the
                               share in quads that the original fills.  A ball has a third, a frame
                               of thin bars a hundred-thousandth: there recall is about quads of a
                               few pixels, of which a sample meets next to none.
    ``options``                how it was measured (``options.views`` is not used where directions
                               were given); ``exact`` also where a sample would have been noise.
    """

    precision: float
    recall: float
    directions: FloatArray
    precision_by_view: FloatArray
    recall_by_view: FloatArray
    nt: FloatArray
    pf: FloatArray
    nf: FloatArray
    coverage: float
    options: AccuracyOptions

    @property
    def worst_view(self) -> int:
        """The view of lowest recall, the first of equals."""
        return int(np.argmin(self.recall_by_view))

    @property
    def worst_precision_view(self) -> int:
        """The view of lowest precision, the first of equals: where most is hidden wrongly."""
        return int(np.argmin(self.precision_by_view))

    @property
    def precision_quantiles(self) -> FloatArray:
        """(7,) float64: precision of the views at :data:`QUANTILE_LEVELS`, lowest first."""
        return np.quantile(self.precision_by_view, QUANTILE_LEVELS)

    @property
    def recall_quantiles(self) -> FloatArray:
        """(7,) float64: recall of the views at :data:`QUANTILE_LEVELS`, lowest first."""
        return np.quantile(self.recall_by_view, QUANTILE_LEVELS)


def evaluate_accuracy(
    mesh: TriangleMesh,
    occluder: Occluder,
    options: AccuracyOptions | None = None,
    *,
    directions: FloatArray | None = None,
    device: Device = PROCESSOR,
) -> AccuracyReport:
    """Judge an occluder by views that no search has seen; the same on any number of threads.

    ``directions``  (V, 3) unit vectors to use in place of ``options.views`` random ones, whatever
                    ``options.viewers`` says.
    ``device``      what draws the pictures; the result is the same on any.

    An occluder without triangles has precision 1 and recall 0.  Where the mesh fills next to
    nothing (:data:`~simplifier.accuracy.verdict.LEAST_COVERAGE`) all quads are counted, since a
    sample would be noise.  Raises :class:`MeshError` when the occluder's arrays cannot be drawn
    and :class:`OptionError` for directions that are not unit
    vectors.
    """
    return evaluate_accuracies(mesh, [occluder], options, directions=directions, device=device)[0]


def evaluate_accuracies(
    mesh: TriangleMesh,
    occluders: Sequence[Occluder],
    options: AccuracyOptions | None = None,
    *,
    directions: FloatArray | None = None,
    device: Device = PROCESSOR,
) -> tuple[AccuracyReport, ...]:
    """As :func:`evaluate_accuracy` each, but the mesh is drawn once for all."""
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    for occluder in occluders:
        check_kind("occluder", occluder, Occluder, AN_OCCLUDER)
    chosen = options if options is not None else AccuracyOptions()
    lines = checked_directions(_sight(chosen) if directions is None else directions)
    found = _measured(mesh, occluders, lines, chosen, device)
    if not chosen.exact and any(0.0 < one.coverage < LEAST_COVERAGE for one in found):
        return _measured(mesh, occluders, lines, replace(chosen, exact=True), device)
    return found


def _measured(
    mesh: TriangleMesh,
    occluders: Sequence[Occluder],
    lines: FloatArray,
    options: AccuracyOptions,
    device: Device,
) -> tuple[AccuracyReport, ...]:
    views = SilhouetteViews.of(mesh, occluders, lines, options.image)

    def count(first: int, last: int) -> tuple[FloatArray, FloatArray]:
        if options.exact:
            original, *hidden = views.masks(device, first, last)
            full = full_areas(original, options.image)
            pixels = [exact_quad_pixels(original, one, options.image, full) for one in hidden]
            return mean_quad_areas(original), np.array(pixels).reshape(-1, last - first, 3)
        sample = QuadSample(options.quads, options.seed, first)
        return views.counted(partial(device.quad_pixels, sample=sample), first, last)

    areas, pixels = zip(*(count(first, last) for first, last in views.blocks()), strict=True)
    every = np.concatenate(areas)
    return tuple(_report(one, every, lines, options) for one in np.concatenate(pixels, axis=1))


def _report(
    pixels: FloatArray, areas: FloatArray, lines: FloatArray, options: AccuracyOptions
) -> AccuracyReport:
    """``pixels`` (V, 3): hidden rightly, missed and hidden wrongly in each view.

    ``areas``  (V,): pixels of a quad, filled or not.
    """
    nt, pf, nf = np.ascontiguousarray(pixels.T)
    return AccuracyReport(
        precision=float(_share(nt.sum(), nf.sum())),
        recall=float(_share(nt.sum(), pf.sum())),
        directions=lines,
        precision_by_view=_share(nt, nf),
        recall_by_view=_share(nt, pf),
        nt=nt,
        pf=pf,
        nf=nf,
        coverage=min(float((nt + pf).sum() / max(areas.sum(), 1.0)), 1.0),
        options=options,
    )


def view_masks(
    mesh: TriangleMesh,
    occluder: Occluder,
    directions: FloatArray,
    image: int,
    device: Device = PROCESSOR,
) -> tuple[BoolArray, BoolArray]:
    """Silhouettes of original and occluder: two (V, image, image) bool arrays.

    ``directions`` (V, 3) unit vectors.  Row 0 is the BOTTOM of the picture (v points up), column 0
    its u-lowest side; flip the rows before showing it as an image.  Raises as
    :func:`evaluate_accuracy`.
    """
    check_whole("image", image, 8, 4096)
    lines = checked_directions(directions)
    views = SilhouetteViews.of(mesh, [occluder], lines, image)
    original, hidden = views.masks(device, 0, len(lines))
    return unpack_masks(original, image), unpack_masks(hidden, image)


def _sight(options: AccuracyOptions) -> FloatArray:
    """(V, 3) random lines of sight of those who can look."""
    directions = random_directions(options.views, options.seed)
    if options.viewers == "above":
        directions = from_above(directions, "xyz".index(options.up))
    return directions


def _share(right: FloatArray, other: FloatArray) -> FloatArray:
    """right / (right + other), and 1 where both are 0."""
    total = np.asarray(right + other)
    return np.divide(right, total, out=np.ones_like(total), where=total > 0.0)


def checked_directions(directions: FloatArray) -> FloatArray:
    """A copy as (V, 3) float64, at least one row, each of length 1."""
    lines = np.array(directions, dtype=np.float64)
    if lines.ndim != 2 or lines.shape[1] != 3 or len(lines) == 0:
        raise OptionError(
            f"directions have shape {lines.shape}", where="directions", remedy="pass (V, 3)"
        )
    if not (np.abs(np.linalg.norm(lines, axis=1) - 1.0) < 1e-6).all():
        raise OptionError(
            "a direction does not have length 1", where="directions", remedy="normalize them"
        )
    return lines
