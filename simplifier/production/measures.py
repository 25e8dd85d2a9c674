"""How a run measures accuracy, from what its user chose."""

from __future__ import annotations

from simplifier.evaluation.accuracy import AccuracyOptions
from simplifier.production.options import EvaluateOptions, SimplifyOptions


def accuracy_options(chosen: SimplifyOptions | EvaluateOptions) -> AccuracyOptions:
    """Those of the same names."""
    return AccuracyOptions(
        chosen.views, chosen.image, chosen.quads, chosen.seed, chosen.exact, chosen.viewers,
        chosen.up,
    )  # fmt: skip
