"""What the report says of levels of detail: a row each, and those that were left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.geometry.lod_chain import LodChain

Rows = list[dict[str, Any]]


def level_rows(
    chain: LodChain, accuracies: Sequence[AccuracyReport], files: Sequence[Path] | None
) -> Rows:
    """A row a level, finest first; ``accuracies`` and ``files`` in the same order.

    ``files`` is None where the levels were not written.
    """
    names = [None] * len(chain.levels) if files is None else [file.name for file in files]
    return [
        {
            "level": index,
            "triangles": level.triangles,
            "error_bound": _finite(level.error_bound),
            "deviation": level.deviation,
            "resolution": level.resolution,
            "switch_distance": _finite(chain.switch_distance(index)),
            "precision": accuracy.precision,
            "recall": accuracy.recall,
            "file": name,
        }
        for index, (level, accuracy, name) in enumerate(
            zip(chain.levels, accuracies, names, strict=True)
        )
    ]


def left_out_rows(chain: LodChain) -> Rows:
    """Resolution and reason of each level that brought nothing."""
    return [asdict(one) for one in chain.left_out]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
