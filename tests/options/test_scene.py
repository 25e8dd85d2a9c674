"""Every value out of range is refused by its name before any work starts."""

from __future__ import annotations

import math

import pytest

from simplifier.errors import OptionError
from simplifier.options.scene import SceneOptions

BAD = [
    ("budget", "budget", [0, 100_001, 2.5, True, "8"]),
    ("resolution", "resolution", [0, 1025, 3.0]),
    ("width", "width", [1, 65, 8.0, True, None]),
    ("moves", "moves", [-1, 10**9, 0.5]),
    ("up", "up", ["w", "", 1, None]),
    ("ground", "ground", [1, "no", None]),
    ("smallest_hole", "smallest hole", [-1.0, math.nan, math.inf, "1"]),
    ("conservative", "conservative", [0, "yes"]),
    ("overhang", "overhang", [-0.1, 1.1, math.nan, "1", True]),
    ("pixel_error", "pixel error", [0.0, -1.0, math.nan, 1001.0, "1", True]),
    ("rows", "rows", [0, 16_385, 1.5]),
    ("fov", "fov", [0.0, 9e-7, 179.5, math.nan, "60", True]),
    ("seed", "seed", [-1, 2**63, 0.0]),
]


@pytest.mark.parametrize(
    ("field", "name", "value"),
    [(field, name, value) for field, name, some in BAD for value in some],
)
def test_out_of_range(field, name, value):
    with pytest.raises(OptionError, match=f"^{name}: "):
        SceneOptions(**{field: value})


def test_limits_are_within():
    SceneOptions(1, 1, 2, 0, "x", True, 1e300, True, 0.0, 1e-9, 1, 1e-6, seed=0)
    SceneOptions(
        100_000, 1024, 64, 100_000_000, "z", False, 0, False, 1.0, 1000, 16_384, 179.0,
        seed=2**63 - 1,
    )  # fmt: skip
