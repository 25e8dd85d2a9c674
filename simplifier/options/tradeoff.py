"""What ``occluder tradeoff`` can be told."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.options.fields import OptionSet, option, shared
from simplifier.options.simplify import (
    LONGEST_SECONDS,
    MOST_TRIANGLES,
    MOST_VOXELS,
    Axis,
    SimplifyOptions,
    Transparent,
)

MOST_DIRECTIONS = 4096
"""The most direction bins of sections, and views of a search."""


@dataclass(frozen=True)
class TradeoffOptions(OptionSet):
    """Which settings are run and timed.

    ``resolutions``, ``directions``, ``times``  the values of each knob, the others at their
    default; with ``full`` every combination.  The presets are always measured, and every budget
    gets all of it.  ``within`` ends the sweep early, with what was measured.
    ``transparent`` is for meshes that are read from files.

    Raises :class:`OptionError` for a value of another kind or out of range.
    """

    resolutions: tuple[int, ...] = option(
        (32, 64, 128), "Resolutions to try.", low=1, high=MOST_VOXELS
    )
    directions: tuple[int, ...] = option(
        (16, 32, 128), "Section directions to try.", low=1, high=MOST_DIRECTIONS
    )
    budgets: tuple[int, ...] = option(
        (16, 64, 256), "Budgets to try. Each gets a table of its own.", low=1, high=MOST_TRIANGLES
    )
    times: tuple[float, ...] = option(
        (0.25, 0.5, 1.0, 2.0, 5.0), "Times to try, seconds.",
        above=0.0, high=LONGEST_SECONDS, unit="seconds",
    )  # fmt: skip
    precision: float = option(
        0.99,
        "Lowest precision, 0 to 1, that a setting may have to be recommended.",
        low=0.0,
        high=1.0,
    )
    repeats: int = option(3, "Runs of each setting. Their median time counts.", low=1, high=1000)
    full: bool = option(False, "Try every combination, not one option at a time.")
    within: float | None = option(
        None, "Seconds for the whole sweep. Settings that are left by then are not run.",
        above=0.0, high=LONGEST_SECONDS, unit="seconds", absent="as long as it takes",
    )  # fmt: skip
    up: Axis = shared(SimplifyOptions, "up")
    ground: bool = shared(SimplifyOptions, "ground")
    transparent: Transparent = shared(SimplifyOptions, "transparent")
    seed: int = shared(SimplifyOptions, "seed")
    memory_limit: float | None = shared(SimplifyOptions, "memory_limit")
