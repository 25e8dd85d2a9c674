"""Convergence, shown: ``python -m bench.stability.convergence [--only PART] [--draw]``.

    report    precision and recall of a fixed occluder against views, pixels and quads
    measure   its occlusion measure against directions and pixels
    making    the occluder against section directions, views, pixels and voxels
    slicers   the two slicers on every shared asset; left out where there is no OpenGL
    forms     the two forms of the measure on every shared asset

Writes ``bench/results/stability_convergence_PART.csv`` (``..._by_value.csv`` beside it holds every
point), the pictures of the first three to ``docs/images``, and prints the tables as Markdown.
Nothing here is a time: a busy machine changes how long it takes and no figure.

``--draw``  only the pictures, from the tables that are there.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from bench.machine import ROOT
from bench.record import Row, markdown, read_table, told, write_table
from bench.stability.convergence import making, measure, report
from bench.stability.convergence.curve import Curve
from bench.stability.convergence.forms import form_rows
from bench.stability.convergence.plot import Cells, plot_errors, plot_gains
from bench.stability.convergence.slicers import slicer_rows
from bench.stability.convergence.subjects import Subject, subjects
from simplifier.errors import BackendUnavailableError
from simplifier.slicing.stencil_buffer import open_stencil
from simplifier.warmup import warm_up

RESULTS, IMAGES = ROOT / "bench" / "results", ROOT / "docs" / "images"

Plot = Callable[[Path, Sequence[Cells], Mapping[str, int], str, str], None]

PICTURES: dict[str, tuple[Plot, Mapping[str, int], str]] = {
    "report": (plot_errors, report.DEFAULT_VALUES, "The report of a fixed occluder"),
    "measure": (plot_errors, measure.DEFAULT_VALUES, "The occlusion measure of a fixed occluder"),
    "making": (plot_gains, making.DEFAULT_VALUES, "What an occluder is made with, five seeds"),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, write and print."""
    parser = argparse.ArgumentParser(prog="python -m bench.stability.convergence")
    parser.description = __doc__
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", choices=tuple(PARTS), help="one part alone")
    parser.add_argument("--draw", action="store_true", help="only the pictures, from the tables")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--images", type=Path, default=IMAGES, help="folder of the pictures")
    given = parser.parse_args(arguments)
    parts = [given.only] if given.only else list(PARTS)
    if not given.draw:
        warm_up()
        for part in parts:
            PARTS[part](given.output)
    for part in PICTURES:
        if part in parts:
            draw(part, given.output, given.images)


def draw(part: str, tables: Path, images: Path) -> None:
    """The picture of a part, from its table of all values."""
    table = read_table(tables / f"stability_convergence_{part}_by_value.csv")
    rows = [dict(zip(table.columns, cells, strict=True)) for cells in table.rows]
    plot, defaults, title = PICTURES[part]
    plot(images / f"convergence_{part}.png", rows, defaults, title, "; ".join(table.remarks[:2]))


def _report(output: Path) -> None:
    _curves("report", report.report_curves, output)


def _measure(output: Path) -> None:
    _curves("measure", measure.measure_curves, output)


def _curves(part: str, curves: Callable[[Subject], Iterable[Curve]], output: Path) -> None:
    found = []
    for subject in subjects():
        for curve in curves(subject):
            print(f"{part}: {told(curve.summary)}", flush=True)
            found.append(curve)
    _write(output, f"{part}_by_value", part, [row for curve in found for row in curve.rows()])
    _show(_write(output, part, part, [curve.summary for curve in found]))


def _making(output: Path) -> None:
    found = []
    for subject in subjects():
        for trial in making.trials(subject):
            print(f"making: {told(trial.row)}", flush=True)
            found.append(trial)
    _write(output, "making_by_value", "making", [trial.row for trial in found])
    _show(_write(output, "making", "making", list(making.verdicts(found))))


def _slicers(output: Path) -> None:
    try:
        context, _ = open_stencil()
    except BackendUnavailableError as error:
        print(f"slicers: skipped: {error}")
        return
    remark = f"OpenGL: {context.info['GL_RENDERER']}"
    context.release()
    _show(_write(output, "slicers", "slicers", _told("slicers", slicer_rows()), remark))


def _forms(output: Path) -> None:
    _show(_write(output, "forms", "forms", _told("forms", form_rows())))


def _told(part: str, rows: Iterable[Row]) -> list[Row]:
    """All of them, each shown to who waits."""
    found = []
    for row in rows:
        found.append(row)
        print(f"{part}: {told(row)}", flush=True)
    return found


def _write(output: Path, name: str, part: str, rows: Sequence[Row], *remarks: str) -> Path:
    path = output / f"stability_convergence_{name}.csv"
    command = f"python -m bench.stability.convergence --only {part}"
    write_table(path, rows, command, *remarks)
    return path


def _show(path: Path) -> None:
    print(f"## {path.stem}\n\n{markdown(read_table(path))}\n", flush=True)


PARTS: dict[str, Callable[[Path], None]] = {
    "report": _report, "measure": _measure, "making": _making, "slicers": _slicers, "forms": _forms,
}  # fmt: skip


if __name__ == "__main__":
    main()
