"""All pictures of one occluder."""

from __future__ import annotations

from dataclasses import dataclass

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.report.histogram import precision_histogram, recall_histogram
from simplifier.report.png import encoded
from simplifier.report.silhouettes import (
    BLACK,
    BLUE,
    YELLOW,
    ViewPicture,
    contact_sheet,
    view_pictures,
)
from simplifier.wording import percent

COLOURS = {"yellow": YELLOW, "black": BLACK, "blue": BLUE}
"""Of the silhouettes, (red, green, blue) from 0 to 255."""


@dataclass(frozen=True, eq=False)
class Gallery:
    """PNG bytes, and the views that they were made from.

    ``views``, ``view_files``  silhouettes, the worst recall first.
    ``sheet``  all of them in one picture with captions.
    ``recall``, ``precision``  histograms over all views.
    """

    views: list[ViewPicture]
    view_files: list[bytes]
    sheet: bytes
    recall: bytes
    precision: bytes


def draw_gallery(mesh: TriangleMesh, occluder: Occluder, accuracy: AccuracyReport) -> Gallery:
    """Draw everything; about a second.  Raises as :func:`~.accuracy.view_masks`."""
    views = view_pictures(mesh, occluder, accuracy)
    count = len(occluder.faces)
    title = (
        f"{count:,} {'triangle' if count == 1 else 'triangles'}, "
        f"recall {percent(accuracy.recall)}, precision {percent(accuracy.precision, 2)}"
    )
    return Gallery(
        views,
        [encoded(view.image) for view in views],
        contact_sheet(views, title),
        recall_histogram(accuracy.recall_by_view),
        precision_histogram(accuracy.precision_by_view),
    )
