"""What is demanded of an occluder, and how its figures fall short."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from simplifier.builds.figures import Figures
from simplifier.option_fields import OptionField

REQUIREMENT_FIELDS = (
    OptionField("min_precision", "number", None, "Least precision.", 0.0, 1.0, nullable=True),
    OptionField("min_recall", "number", None, "Least recall.", 0.0, 1.0, nullable=True),
    OptionField("max_triangles", "whole", None, "Most triangles.", 1, 100_000, nullable=True),
    OptionField("max_recall_loss", "number", 0.005, "Most recall lost to before.", 0.0, 1.0),
)
"""What ``require`` of a manifest may hold."""


@dataclass(frozen=True)
class Requirements:
    """As :data:`REQUIREMENT_FIELDS` says; None demands nothing."""

    min_precision: float | None = None
    min_recall: float | None = None
    max_triangles: int | None = None
    max_recall_loss: float = 0.005


def shortfalls(demanded: Requirements, found: Figures, before: Figures | None) -> Iterator[str]:
    """In words, each way in which an occluder is not good enough.

    ``before``  its figures where the change is compared to, if they are known.
    """
    if demanded.min_precision is not None and found.precision < demanded.min_precision:
        yield f"precision {_share(found.precision)} is below {_share(demanded.min_precision)}"
    if demanded.min_recall is not None and found.recall < demanded.min_recall:
        yield f"recall {_share(found.recall)} is below {_share(demanded.min_recall)}"
    if demanded.max_triangles is not None and found.triangles > demanded.max_triangles:
        yield f"{found.triangles:,} triangles are more than {demanded.max_triangles:,}"
    if before is not None and before.recall - found.recall > demanded.max_recall_loss:
        yield f"recall fell from {_share(before.recall)} to {_share(found.recall)}"


def _share(value: float) -> str:
    """In full where rounding would hide what is wrong: 79.996 % is not 80 %."""
    return f"{100.0 * value:.4f}".rstrip("0").rstrip(".") + " %"
