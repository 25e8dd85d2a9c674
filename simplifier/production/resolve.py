"""What a user chose for one run -> the options of every stage."""

from __future__ import annotations

from simplifier.lods.options import finest_bound
from simplifier.options import Options, make_options
from simplifier.production.options import EvaluateOptions, SimplifyOptions

Chosen = SimplifyOptions | EvaluateOptions


def resolved(chosen: Chosen, longest_edge: float) -> Options:
    """The options of the occluder, or of the finest level, of a mesh of that size."""
    if isinstance(chosen, EvaluateOptions):
        return make_options(
            longest_edge, resolution=chosen.resolution, up=chosen.up, ground=chosen.ground,
            viewers=chosen.viewers, smallest_hole=chosen.smallest_hole,
        )  # fmt: skip
    bound = chosen.error_bound
    if chosen.levels is not None:
        bound = finest_bound(chosen.levels, chosen.resolution, bound)
    return make_options(
        longest_edge, budget=chosen.budget, resolution=chosen.resolution, error_bound=bound,
        up=chosen.up, ground=chosen.ground, viewers=chosen.viewers,
        smallest_hole=chosen.smallest_hole, conservative=chosen.conservative, shrink=chosen.shrink,
        trim=chosen.trim, slicer=chosen.slicer, alpha=chosen.alpha, preset=chosen.preset,
        min_precision=chosen.min_precision, moves=chosen.moves, time_limit=chosen.time_limit,
        seed=chosen.seed,
    )  # fmt: skip
