"""What a kernel takes, in numba's words."""

from __future__ import annotations

from typing import Any

import numba
import numba.core

from simplifier.kernels.compiled.signature import Group, Number, Part

types: Any = numba.core.types


def numba_types(signature: Group) -> tuple[Any, ...]:
    """The type of each argument."""
    return tuple(map(_numba_type, signature.parts))


def _numba_type(part: Part) -> Any:
    match part:
        case Group(parts):
            return types.BaseTuple.from_types([_numba_type(one) for one in parts])
        case Number():
            return numba.from_dtype(part.dtype)
    return types.Array(numba.from_dtype(part.dtype), part.axes, "C")
