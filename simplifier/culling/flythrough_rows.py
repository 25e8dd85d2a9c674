"""The frames of a flythrough as CSV: one header, a row a frame, a row of sums, no comments;
docs/culling.md names the columns.

A flythrough in words: the rows of the terminal, and the lines over its pictures.
"""

from __future__ import annotations

import csv
import io
import statistics
from collections.abc import Mapping

from simplifier.culling.drawn import Drawn, Spread, Way
from simplifier.culling.fate import Counts
from simplifier.culling.flythrough import Flythrough
from simplifier.culling.frame import FrameFigures
from simplifier.wording import count, percent, small_percent

_COUNTS = ("in_view", "hidden", "culled", "missed", "wrong", "lost", "recall")

COLUMNS = (
    "frame",
    *(f"objects_{name}" for name in _COUNTS),
    *(f"parts_{name}" for name in _COUNTS),
    "covered_pixels", "wrong_pixels", "wrong_share", "occluders", "occluder_triangles",
    "scene_triangles", "triangles_in_view", "milliseconds",
    *(f"{way}_drawn_{name}" for way in Way for name in ("objects", "triangles")),
    *(f"{way}_wrong_{name}" for way in Way for name in ("objects", "pixels")), "outside_cells",
)  # fmt: skip
"""New ones go to the end; none changes its meaning."""

TOTAL = "total"
"""In place of the frame's number in the last row: sums, and shares of sums."""


def flythrough_csv(flown: Flythrough) -> bytes:
    """ASCII CSV, lines end in LF; empty cells are shares of nothing, and of sets where none are."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for frame in flown.frames:
        writer.writerow({"frame": str(frame.index), **_cells(frame.figures)})
    writer.writerow({"frame": TOTAL, **_cells(flown.total)})
    return text.getvalue().encode("ascii")


def _cells(figures: FrameFigures) -> dict[str, str]:
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
        **_drawn_cells(figures.drawn),
        "outside_cells": str(figures.outside_cells) if Way.PVS in figures.drawn else "",
    }


def _drawn_cells(drawn: Mapping[Way, Drawn]) -> dict[str, str]:
    cells = {}
    for way, one in drawn.items():
        cells[f"{way}_drawn_objects"] = str(one.objects)
        cells[f"{way}_drawn_triangles"] = str(one.triangles)
        cells[f"{way}_wrong_objects"] = str(one.wrong_objects)
        cells[f"{way}_wrong_pixels"] = str(one.wrong_pixels)
    return cells


def _count_cells(what: str, counts: Counts) -> dict[str, str]:
    cells = {f"{what}_{name}": str(getattr(counts, name)) for name in _COUNTS if name != "recall"}
    recall = "" if counts.recall is None else f"{counts.recall:.6f}"
    return {**cells, f"{what}_recall": recall}


COUNTED = (
    "hidden: visible in no pixel, though it would cover one alone; a part is an object or a piece "
    "of a large one; wrong pixels show a part that was culled"
)
"""What the figures count, in one line."""


def summary_rows(flown: Flythrough) -> list[tuple[str, str]]:
    """Named values for the terminal."""
    whole, frames = flown.total, len(flown.frames)
    recall, wrong = worst_words(flown)
    triangles = f"{whole.occluder_triangles / frames:,.0f} a frame"
    of_all = small_percent(whole.triangle_share)
    return [
        ("frames", _frames(flown)),
        ("parts", recall_words(whole.parts)),
        ("fewest parts", recall),
        ("objects", recall_words(whole.objects)),
        ("wrongly culled", _wrong_words(whole.parts)),
        *_rows_of_losses(whole),
        ("wrong pixels", pixel_words(whole)),
        ("most wrong", wrong),
        (
            "occluder triangles",
            f"{triangles}, {of_all} of the scene's",
        ),
        ("occluders", f"{whole.occluders / frames:,.0f} a frame"),
        ("time to cull", f"{median_milliseconds(flown):.2f} ms a frame (median)"),
        *_rows_of_cells(flown),
    ]


CULLED_BY = {
    Way.FRUSTUM: "view frustum",
    Way.PVS: "visible sets",
    Way.OCCLUDERS: "occluders",
    Way.BOTH: "both",
}


Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, columns and rows."""


def drawn_tables(flown: Flythrough) -> tuple[Table, Table]:
    """What is drawn in a frame by each way of culling: objects, and triangles."""
    whole = flown.total
    objects: list[tuple[str, ...]] = []
    triangles: list[tuple[str, ...]] = []
    for way, total in whole.drawn.items():
        of_frames = [frame.figures.drawn[way] for frame in flown.frames]
        share = drawn_share(whole, way)
        spread = _spread_words([one.objects for one in of_frames])
        objects.append((CULLED_BY[way], f"{total.wrong_objects:,}", *spread))
        spread = _spread_words([one.triangles for one in of_frames])
        of_view = "" if share is None else percent(share)
        triangles.append((CULLED_BY[way], of_view, f"{total.wrong_pixels:,}", *spread))
    spread = ("mean", "median", "worst", "in frame")
    return (
        ("objects drawn in a frame", ("culled by", "wrong objects", *spread), objects),
        (
            "triangles drawn in a frame",
            ("culled by", "of the frustum's", "wrong pixels", *spread),
            triangles,
        ),
    )


def drawn_share(whole: FrameFigures, way: Way) -> float | None:
    """Triangles that a way of culling leaves, of those in the frustum; None where none are."""
    there = whole.drawn[Way.FRUSTUM].triangles
    return whole.drawn[way].triangles / there if there else None


def _spread_words(values: list[int]) -> tuple[str, str, str, str]:
    found = Spread.of(values)
    return f"{found.mean:,.0f}", f"{found.median:,.0f}", f"{found.most:,}", f"{found.frame}"


def _rows_of_cells(flown: Flythrough) -> list[tuple[str, str]]:
    if flown.sets is None:
        return []
    outside = f"{flown.total.outside_cells:,} of {count(len(flown.frames), 'frame')}"
    return [("outside of all cells", f"{outside}, from which the sets have everything")]


def recall_words(counts: Counts) -> str:
    """``"98.9 % of 26,389 hidden culled"``."""
    if counts.recall is None:
        return "none hidden"
    return f"{percent(counts.recall)} of {counts.hidden:,} hidden culled"


def pixel_words(figures: FrameFigures) -> str:
    """``"14 of 15,035,282 (0.000093 %)"``."""
    shown = f" ({small_percent(figures.wrong_share)})" if figures.wrong_pixels else ""
    return f"{figures.wrong_pixels:,} of {figures.covered_pixels:,}{shown}"


def worst_words(flown: Flythrough) -> tuple[str, str]:
    """Where least of the hidden parts was culled, and where the picture had the most holes."""
    least, holes = flown.worst_recall, flown.worst_picture
    recall, wrong = "none hidden", "none wrong"
    if least is not None:
        recall = f"{percent(least.figures.parts.recall or 0.0)} culled, in frame {least.index}"
    if holes.figures.wrong_pixels:
        wrong = f"{small_percent(holes.figures.wrong_share)} of pixels, in frame {holes.index}"
    return recall, wrong


def median_milliseconds(flown: Flythrough) -> float:
    return statistics.median(frame.figures.milliseconds for frame in flown.frames)


def _frames(flown: Flythrough) -> str:
    whole = len(flown.path.cameras)
    done = f"{whole:,}" if flown.complete else f"{len(flown.frames):,} of {whole:,}"
    buffer = f"{flown.options.columns} x {flown.options.rows} pixels"
    return f"{done} of path '{flown.path.name}', {buffer}, pixel error {flown.pixel_error:g}"


def _wrong_words(parts: Counts) -> str:
    return f"{count(parts.wrong, 'part')} of {parts.in_view - parts.hidden:,} visible"


def _rows_of_losses(whole: FrameFigures) -> list[tuple[str, str]]:
    """Only where the tests are at fault."""
    if not whole.parts.lost:
        return []
    return [("LOST", f"{whole.parts.lost:,} visible parts held to be outside of the view")]
