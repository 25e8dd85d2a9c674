"""The frames of a flythrough as CSV: one header, a row a frame, a row of sums, no comments;
docs/culling.md names the columns."""

from __future__ import annotations

import csv
import io

from simplifier.culling.fate import Counts
from simplifier.culling.flythrough import Flythrough
from simplifier.culling.frame import Figures

_COUNTS = ("in_view", "hidden", "culled", "missed", "wrong", "lost", "recall")

COLUMNS = (
    "frame",
    *(f"objects_{name}" for name in _COUNTS),
    *(f"parts_{name}" for name in _COUNTS),
    "covered_pixels", "wrong_pixels", "wrong_share", "occluders", "occluder_triangles",
    "scene_triangles", "triangles_in_view", "milliseconds",
)  # fmt: skip
"""New ones go to the end; none changes its meaning."""

TOTAL = "total"
"""In place of the frame's number in the last row: sums, and shares of sums."""


def table_bytes(flown: Flythrough) -> bytes:
    """ASCII CSV, lines end in LF; empty cells are shares of nothing."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for frame in flown.frames:
        writer.writerow({"frame": str(frame.index), **_cells(frame.figures)})
    writer.writerow({"frame": TOTAL, **_cells(flown.total)})
    return text.getvalue().encode("ascii")


def _cells(figures: Figures) -> dict[str, str]:
    return {
        **_count_cells("objects", figures.objects),
        **_count_cells("parts", figures.parts),
        "covered_pixels": str(figures.covered_pixels),
        "wrong_pixels": str(figures.wrong_pixels),
        "wrong_share": f"{figures.wrong_share:.9f}",
        "occluders": str(figures.occluders),
        "occluder_triangles": str(figures.occluder_triangles),
        "scene_triangles": str(figures.scene_triangles),
        "triangles_in_view": str(figures.triangles_in_view),
        "milliseconds": f"{figures.milliseconds:.3f}",
    }


def _count_cells(what: str, counts: Counts) -> dict[str, str]:
    cells = {f"{what}_{name}": str(getattr(counts, name)) for name in _COUNTS if name != "recall"}
    recall = "" if counts.recall is None else f"{counts.recall:.6f}"
    return {**cells, f"{what}_recall": recall}
