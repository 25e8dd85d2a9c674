"""How a run measures accuracy, from what its user chose."""

from __future__ import annotations

from simplifier.accuracy.accuracy import AccuracyOptions
from simplifier.memory.runs import Judging
from simplifier.production.options import EvaluateOptions, SimplifyOptions


def judging_of(chosen: SimplifyOptions | EvaluateOptions) -> Judging:
    """What of it memory depends on; all levels of detail that are asked for may be kept."""
    count = 1
    if isinstance(chosen, SimplifyOptions):
        count = len(chosen.error_bounds) if chosen.error_bounds is not None else chosen.lods or 1
    return Judging(chosen.views, chosen.image, count, chosen.exact)


def accuracy_options(chosen: SimplifyOptions | EvaluateOptions) -> AccuracyOptions:
    """Those of the same names."""
    return AccuracyOptions(
        chosen.views, chosen.image, chosen.quads, chosen.seed, chosen.exact, chosen.viewers,
        chosen.up,
    )  # fmt: skip
