"""What is known of a finished occluder, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_SHARE_DIGITS = 6


@dataclass(frozen=True)
class Figures:
    """Of the finest level where there are several.

    ``precision``, ``recall``  from 0 to 1, to six digits.
    ``deviation``    how far it strays from the mesh, in its units, to six significant digits.
    ``error_bound``  how far it may; None where no promise was made.
    """

    triangles: int
    precision: float
    recall: float
    deviation: float
    error_bound: float | None

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> Figures:
        """Of a report as ``docs/report.schema.json`` says."""
        bound = report["error_bound"]
        return cls(
            int(report["triangles"]),
            round(report["precision"], _SHARE_DIGITS),
            round(report["recall"], _SHARE_DIGITS),
            _short(report["deviation"]),
            None if bound is None else _short(bound),
        )


def _short(length: float) -> float:
    return float(f"{length:.6g}")
