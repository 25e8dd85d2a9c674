"""Convergence, shown: ``python -m bench.stability.convergence [--only PART]``.

    report    precision and recall of a fixed occluder against views, pixels and quads
    measure   its occlusion measure against directions and pixels
    making    the occluder against section directions, views, pixels and voxels
    slicers   the two slicers on every shared asset; left out where there is no OpenGL
    forms     the two forms of the measure on every shared asset

Writes ``bench/results/stability_convergence_PART.csv`` (``..._by_value.csv`` beside it holds every
point), the pictures of the first three to ``docs/images``, and prints the tables as Markdown.
Nothing here is a time: a busy machine changes how long it takes and no figure.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from bench.machine import ROOT
from bench.record import Row, markdown, read_table, told, write_table
from bench.stability.convergence.curve import Curve
from bench.stability.convergence.forms import form_rows
from bench.stability.convergence.making import trials, verdicts
from bench.stability.convergence.measure import measure_curves
from bench.stability.convergence.plot import plot_errors, plot_trials
from bench.stability.convergence.report import report_curves
from bench.stability.convergence.slicers import slicer_rows
from bench.stability.convergence.subjects import Subject, subjects
from simplifier.errors import BackendUnavailableError
from simplifier.slicing.opengl import open_context
from simplifier.warmup import warm_up

RESULTS, IMAGES = ROOT / "bench" / "results", ROOT / "docs" / "images"


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line, measure, write and print."""
    parser = argparse.ArgumentParser(prog="python -m bench.stability.convergence")
    parser.description = __doc__
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", choices=tuple(PARTS), help="one part alone")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--images", type=Path, default=IMAGES, help="folder of the pictures")
    given = parser.parse_args(arguments)
    warm_up()
    for part in [given.only] if given.only else PARTS:
        PARTS[part](given.output, given.images)


def _report(output: Path, images: Path) -> None:
    _curves("report", "A fixed occluder's report", report_curves, output, images)


def _measure(output: Path, images: Path) -> None:
    _curves("measure", "A fixed occluder's measure", measure_curves, output, images)


def _curves(
    part: str,
    title: str,
    measure: Callable[[Subject], Iterable[Curve]],
    output: Path,
    images: Path,
) -> None:
    found = [curve for subject in subjects() for curve in measure(subject)]
    _write(output, f"{part}_by_value", part, [row for curve in found for row in curve.rows()])
    _show(_write(output, part, part, [curve.summary for curve in found]))
    plot_errors(images / f"convergence_{part}.png", found, title, _command(part))


def _making(output: Path, images: Path) -> None:
    found = [trial for subject in subjects() for trial in trials(subject)]
    _write(output, "making_by_value", "making", [trial.row for trial in found])
    _show(_write(output, "making", "making", list(verdicts(found))))
    title = "What an occluder is made with (mean of five seeds, standard errors)"
    plot_trials(images / "convergence_making.png", found, title, _command("making"))


def _slicers(output: Path, images: Path) -> None:
    del images
    try:
        context, _ = open_context()
    except BackendUnavailableError as error:
        print(f"slicers: skipped: {error}")
        return
    remark = f"OpenGL: {context.info['GL_RENDERER']}"
    context.release()
    _show(_write(output, "slicers", "slicers", _told("slicers", slicer_rows()), remark))


def _forms(output: Path, images: Path) -> None:
    del images
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
    write_table(path, rows, _command(part), *remarks)
    return path


def _show(path: Path) -> None:
    print(f"## {path.stem}\n\n{markdown(read_table(path))}\n", flush=True)


def _command(part: str) -> str:
    return f"python -m bench.stability.convergence --only {part}"


PARTS: dict[str, Callable[[Path, Path], None]] = {
    "report": _report, "measure": _measure, "making": _making, "slicers": _slicers, "forms": _forms,
}  # fmt: skip


if __name__ == "__main__":
    main()
