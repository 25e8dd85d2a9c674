"""What a user can choose for a flythrough."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.checks import check_above_zero, check_whole
from simplifier.culling.depth_buffer import LARGEST_SCREEN


@dataclass(frozen=True)
class CullOptions:
    """How a flythrough is measured.

    ``rows``, ``columns``  of the depth buffer, pixels, 1 to 16384 / ``detail``.
    ``pixel_error``  of the occluders that are drawn, at most, pixels, above 0 to 1000; None is what
                     they were built for.  Raising it draws fewer triangles and hides less.
    ``detail``       pixels of the item buffer along one of the depth buffer, 1 to 16.
    ``repeats``      times that a frame is culled, 1 to 1000; the least time counts.
    ``shots``        frames that pictures are kept of, spread over the path, 0 to 100.
    """

    rows: int = 180
    columns: int = 320
    pixel_error: float | None = None
    detail: int = 4
    repeats: int = 3
    shots: int = 12

    def __post_init__(self) -> None:
        check_whole("detail", self.detail, 1, 16)
        check_whole("rows", self.rows, 1, LARGEST_SCREEN // self.detail)
        check_whole("columns", self.columns, 1, LARGEST_SCREEN // self.detail)
        check_whole("repeats", self.repeats, 1, 1000)
        check_whole("shots", self.shots, 0, 100)
        if self.pixel_error is not None:
            check_above_zero("pixel error", self.pixel_error, 1000.0)
