"""One self-contained HTML page about one occluder: nothing is fetched, nothing is executed.

Pictures are data URIs and the page's own security policy forbids all else.  This module makes words
of the figures; the markup is in ``page.html``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.checks import as_path
from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.io.files import make_folder, write_whole
from simplifier.wording import (
    distance_range,
    grid_size,
    length,
    percent,
    percent_at_most,
    seconds,
    small_percent,
    viewpoint,
)

if TYPE_CHECKING:
    from simplifier.report.gallery import Gallery
    from simplifier.report.silhouettes import ViewPicture

Report = Mapping[str, Any]
Rows = Sequence[tuple[str, str]]

PAGE = "report.html"
"""What the page is called in its folder."""

_LEVEL_COLUMNS = (
    "Level", "Verdict", "Triangles", "Recall", "Precision", "Overhang", "Error bound", "Deviation",
    "Voxels", "Distance", "File",
)  # fmt: skip


def write_pictures(
    folder: str | Path,
    mesh: TriangleMesh,
    occluder: Occluder,
    accuracy: AccuracyReport,
    report: Report,
    *,
    name: str = "mesh",
    device: Device = PROCESSOR,
) -> list[Path]:
    """Write the contact sheet, every view, both histograms and the page; return what was written.

    ``folder`` is made when it is not there; files of the same names are replaced, each whole or not
    at all.  ``name`` is what the page calls the mesh; the ``device`` draws.  Raises
    :class:`OutputError`.
    """
    # Here, not above: matplotlib takes half a second to import, and most runs draw nothing.
    from simplifier.report.gallery import draw_gallery

    place = as_path("folder", folder)
    make_folder(place)
    gallery = draw_gallery(mesh, occluder, accuracy, device)
    files = {"silhouettes.png": gallery.sheet}
    for index, (view, data) in enumerate(zip(gallery.views, gallery.view_files, strict=True)):
        files[f"view_{index:02d}_{view.name.replace(' ', '_')}.png"] = data
    files["recall.png"] = gallery.recall
    files["precision.png"] = gallery.precision
    for file, data in files.items():
        write_whole(place / file, data)
    write_page(place / PAGE, report, gallery, name=name)
    return [place / file for file in [*files, PAGE]]


def write_page(path: str | Path, report: Report, gallery: Gallery, *, name: str = "mesh") -> None:
    """Write the page, whole or not at all.  Raises :class:`OutputError`."""
    write_whole(
        as_path("path", path), page_text(report, gallery, name=name).encode("utf-8", "replace")
    )


def page_text(report: Report, gallery: Gallery, *, name: str = "mesh") -> str:
    """The page as HTML text; ``report`` has the keys of :func:`~.report.build_report`."""
    # Here, not above: a run that writes no page loads neither.
    from simplifier.report.gallery import COLOURS
    from simplifier.report.templates import page_html, png_address

    both = {"recall": gallery.recall, "precision": gallery.precision}
    return page_html(
        "report/page.html",
        heading="Occluder of",
        name=name,
        summary=_summary(report),
        verdict=report["verdict"],
        warnings=report["warnings"],
        tiles=_tiles(report),
        levels=_level_rows(report.get("levels", ())),
        level_columns=_LEVEL_COLUMNS,
        left_out=[
            f"{one['resolution']:,} voxels: {one['reason']}" for one in report.get("left_out", ())
        ],
        colours={word: "#{:02x}{:02x}{:02x}".format(*rgb) for word, rgb in COLOURS.items()},
        views=[
            {"address": png_address(data), **_view_words(view)}
            for view, data in zip(gallery.views, gallery.view_files, strict=True)
        ],
        histograms=[(png_address(data), _spread(report, key)) for key, data in both.items()],
        timings=list(_timing_rows(report["timings"])),
        total_time=seconds(sum(report["timings"].values())),
        decisions=report.get("decisions", ()),
        facts=[
            ("Input", _input_rows(report["input"], report["coverage"])),
            ("Solid", _solid_rows(report["solid"])),
            ("Options", list(_option_rows(report["options"]))),
        ],
        colophon=(
            f"planar-occluder {report['version']}, seed {report['seed']}, "
            f"report schema {report['schema_version']}, drawn by {report.get('device', 'cpu')}"
        ),
    )


def _summary(report: Report) -> str:
    """One line: what came of what, and how sure that is."""
    bound = report["error_bound"]
    within = "" if bound is None else f", at most {length(bound)} units from the original"
    return (
        f"{report['input']['triangles']:,} triangles in, {report['triangles']:,} out{within}. "
        f"Judged from {len(report['by_view']):,} directions."
    )


def _tiles(report: Report) -> list[tuple[str, str, str]]:
    """The headline figures: what each is, its value and a note."""
    worst, over, front = report["worst_view"], report["overhang"], report["front"]
    return [
        ("Recall", percent(report["recall"], 2), "of what could be hidden is hidden"),
        ("Precision", percent(report["precision"], 2), "of what is hidden is hidden rightly"),
        (
            "Worst view",
            percent(worst["recall"], 2),
            f"recall {viewpoint(worst['direction'], _up_of(report))}",
        ),
        (
            "Overhang",
            percent_at_most(over["share"]),
            f"covered beside it; at worst {percent_at_most(over['worst_view']['share'])},"
            f" {length(over['stick_out'])} units out",
        ),
        (
            "Front",
            percent_at_most(front["share"]),
            "of what is seen lies well behind it; at worst"
            f" {percent_at_most(front['worst_view']['share'])}",
        ),
        ("Triangles", f"{report['triangles']:,}", f"from {report['input']['triangles']:,}"),
        (
            "Occlusion kept",
            percent(report["occlusion_measure"]["ratio"], 2),
            "of the total measure",
        ),
        ("Error bound", length(report["error_bound"]), "units, the most that is allowed"),
        ("Deviation", length(report["deviation"]), "units, the most that was found"),
    ]


def _up_of(report: Report) -> str:
    """The mesh's up axis."""
    up: str = report["options"].get("accuracy", {}).get("up", "y")
    return up


def _level_rows(levels: Sequence[Report]) -> list[tuple[str, ...]]:
    starts = [level["switch_distance"] for level in levels]
    return [_level_cells(level, distance_range(level["level"], starts)) for level in levels]


def _level_cells(level: Report, distance: str) -> tuple[str, ...]:
    """As :data:`_LEVEL_COLUMNS` has them."""
    return (
        str(level["level"]),
        level["verdict"]["word"],
        f"{level['triangles']:,}",
        percent(level["recall"], 2),
        percent(level["precision"], 2),
        percent_at_most(level["overhang"]["share"]),
        length(level["error_bound"]),
        length(level["deviation"]),
        f"{level['resolution']:,}",
        distance,
        level["file"] or "not written",
    )


def _view_words(view: ViewPicture) -> dict[str, Any]:
    return {
        "name": view.name,
        "title": view.name.capitalize(),
        "is_worst": view.name.startswith("worst"),
        "figures": f"recall {percent(view.recall, 2)}, precision {percent(view.precision, 2)}",
        "along": f"seen {view.viewpoint}",
    }


def _spread(report: Report, key: str) -> str:
    """A histogram's range in words, for who cannot see it."""
    values = [view[key] for view in report["by_view"]]
    return f"Histogram of {key} by view, from {percent(min(values))} to {percent(max(values))}"


def _timing_rows(timings: Mapping[str, float]) -> Iterator[tuple[str, str, str]]:
    """Stage, time, and its bar in percent of the longest; stages that did not run are left out."""
    longest = max([*timings.values(), 1e-9])
    for stage, time in timings.items():
        if time > 0.0:
            yield stage, seconds(time), f"{100.0 * time / longest:.2f}"


def _input_rows(facts: Report, coverage: float) -> Rows:
    low, high = facts["bounds"]
    dropped = [
        f"{count:,} {reason.replace('_', ' ')}"
        for reason, count in facts["dropped"].items()
        if count
    ]
    omitted = [f"{one['triangles']:,} of {one['name']}" for one in facts["omitted"]]
    return [
        ("triangles", f"{facts['triangles']:,}"),
        ("vertices", f"{facts['vertices']:,}"),
        ("lowest corner", ", ".join(map(length, low))),
        ("highest corner", ", ".join(map(length, high))),
        ("left out", ", ".join([*dropped, *omitted]) or "none"),
        ("fills", f"{small_percent(coverage)} of what is looked at"),
    ]


def _solid_rows(facts: Report) -> Rows:
    closed = [
        f"{item['by']} (added {length(item['volume'])} cubic units)" for item in facts["closed_by"]
    ]
    return [
        ("resolution", f"{grid_size(facts['resolution'])} voxels"),
        ("cell size", f"{length(facts['cell_size'])} units"),
        ("inside", percent(facts["inside_fraction"])),
        ("closed by", ", ".join(closed) or "nothing but its own surface"),
    ]


def _option_rows(options: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Those of a group each with the group's name before its own."""
    for name, value in options.items():
        words = name.replace("_", " ")
        if isinstance(value, Mapping):
            yield from ((f"{words}: {own}", text) for own, text in _option_rows(value))
        else:
            yield words, _value_words(value)


def _value_words(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(_value_words, value)) or "none"
    return "default" if value is None else str(value)
