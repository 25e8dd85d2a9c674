"""One self-contained HTML page about one occluder: nothing is fetched, nothing is executed.

Pictures are data URIs and the page's own security policy forbids all else.  Every word that comes
from outside (the mesh's name, warnings, options) is escaped.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.checks import as_path
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.io.files import make_folder, write_whole
from simplifier.report import page_parts as parts
from simplifier.report.page_levels import levels

if TYPE_CHECKING:
    from simplifier.report.gallery import Gallery

Report = Mapping[str, Any]


def write_pictures(
    folder: str | Path,
    mesh: TriangleMesh,
    occluder: Occluder,
    accuracy: AccuracyReport,
    report: Report,
    *,
    name: str = "mesh",
) -> list[Path]:
    """Write the contact sheet, every view, both histograms and the page; return what was written.

    ``folder`` is made when it is not there; files of the same names are replaced, each whole or not
    at all.  ``name`` is what the page calls the mesh.  Raises :class:`OutputError`.
    """
    # Here, not above: matplotlib takes half a second to import, and most runs draw nothing.
    from simplifier.report.gallery import draw_gallery

    place = as_path("folder", folder)
    make_folder(place)
    gallery = draw_gallery(mesh, occluder, accuracy)
    files = {"silhouettes.png": gallery.sheet}
    for index, (view, data) in enumerate(zip(gallery.views, gallery.view_files, strict=True)):
        files[f"view_{index:02d}_{view.name.replace(' ', '_')}.png"] = data
    files["recall.png"] = gallery.recall
    files["precision.png"] = gallery.precision
    for file, data in files.items():
        write_whole(place / file, data)
    write_page(place / "report.html", report, gallery, name=name)
    return [place / file for file in [*files, "report.html"]]


def write_page(path: str | Path, report: Report, gallery: Gallery, *, name: str = "mesh") -> None:
    """Write the page, whole or not at all.  Raises :class:`OutputError`."""
    write_whole(
        as_path("path", path), page_text(report, gallery, name=name).encode("utf-8", "replace")
    )


def page_text(report: Report, gallery: Gallery, *, name: str = "mesh") -> str:
    """The page as HTML text; ``report`` has the keys of :func:`~.report.build_report`."""
    from simplifier.report.gallery import COLOURS

    template = Template((Path(__file__).parent / "page.html").read_text("utf-8"))
    colours = {word: "#{:02x}{:02x}{:02x}".format(*rgb) for word, rgb in COLOURS.items()}
    return template.substitute(
        colours,
        name=escape(name),
        summary=escape(parts.summary(report)),
        warnings=parts.warnings(report["warnings"]),
        tiles=parts.tiles(report),
        levels=levels(report),
        views="".join(map(parts.view, gallery.views, gallery.view_files)),
        histograms=parts.histograms(report, gallery.recall, gallery.precision),
        timings=parts.timings(report["timings"]),
        facts="".join(parts.facts(report)),
        colophon=escape(
            f"planar-occluder {report['version']}, seed {report['seed']}, "
            f"report schema {report['schema_version']}"
        ),
    )
