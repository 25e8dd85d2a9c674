"""LLVM's instructions for where eight edges meet rows of pixels."""

from __future__ import annotations

from typing import Any

from simplifier.kernels.compiled.lanes import CELLS, NUMBERS, call, constant, greatest, least


def crossing(builder: Any, low_x: Any, low_y: Any, high_x: Any, high_y: Any, height: Any) -> Any:
    """As :func:`~..faces.crossing`, to the last bit."""
    share = builder.fdiv(builder.fsub(height, low_y), builder.fsub(high_y, low_y))
    return builder.fadd(low_x, builder.fmul(share, builder.fsub(high_x, low_x)))


def cell_of(builder: Any, value: Any, count: Any) -> Any:
    """The first of ``count`` pixels, a float64, with its centre at or past a coordinate; that
    number where there is none."""
    inside = least(builder, greatest(builder, value, constant(NUMBERS, 0.0)), count)
    return builder.fptosi(call(builder, "ceil", NUMBERS, inside), CELLS)
