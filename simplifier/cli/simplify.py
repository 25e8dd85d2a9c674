"""The command that makes an occluder from a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.api import simplify as simplify_soup
from simplifier.cli.console import print_line, print_rows
from simplifier.cli.options import Mesh, PicturesFolder, ReportFile, read_options, with_options
from simplifier.cli.overrides import NoOverrides, OverridesFile, chosen_overrides
from simplifier.cli.report import Strict, check_extras, run_and_show
from simplifier.cli.running import Debug, Interrupts
from simplifier.errors import OptionError, OutputError
from simplifier.io.glb_embed import check_place
from simplifier.io.load import load
from simplifier.io.save import check_writable, is_level_path
from simplifier.memory.limit import default_limit
from simplifier.memory.need import BASE_BYTES, GIB
from simplifier.options.simplify import SimplifyOptions, Style, WriteOptions
from simplifier.production.estimate import check_file, estimate_memory
from simplifier.progress import Listener, Stopwatch
from simplifier.report.report import Report, write_report


@with_options(SimplifyOptions, WriteOptions)
def simplify(
    mesh: Mesh,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="The occluder: glb, occ, obj, ply, off, stl, tres."),
    ],
    *,
    overrides: OverridesFile = None,
    no_overrides: NoOverrides = False,
    report: ReportFile = None,
    pictures: PicturesFolder = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what memory it would need, and make nothing.")
    ] = False,
    strict: Strict = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make an occluder from a mesh and report its precision and recall.

    With levels of detail the output holds all of them if it is a glb, and each goes to a file of
    its own, NAME_lod0 and so on; levels that bring nothing are left out.

    Ctrl-C ends the refining and keeps the best so far; once more ends the command at once.
    """

    def run(listener: Listener, interrupts: Interrupts) -> Report | None:
        options = read_options(SimplifyOptions, chosen)
        writing = read_options(WriteOptions, chosen)
        style = Style(writing.sides, writing.as_quads)
        check_writable(output, style)
        if writing.with_original is not None:
            _check_embedding(mesh, output, levels=options.levels is not None)
        _check_distinct(mesh, output, levels=options.levels is not None)
        check_extras(report, pictures)
        by_hand = chosen_overrides(mesh, overrides, no_overrides)
        if dry_run:
            _foretell(mesh, options, pictures=pictures is not None)
            return None
        check_file(mesh, options, pictures=pictures is not None)
        watch = Stopwatch(listener)
        with watch.stage("load"):
            soup = load(
                mesh,
                transparent=options.transparent,
                ignore=by_hand.ignore,
                memory_limit=options.memory_limit,
            )
        kept = reported = False
        try:
            with interrupts.deferred() as cancel:
                made = simplify_soup(
                    soup, options, listener=listener, cancel=cancel, overrides=by_hand
                )
                with interrupts.held(), watch.stage("write"):
                    if writing.with_original is None:
                        files = made.save(output, style)
                    else:
                        files = made.save_with_original(mesh, output, writing.with_original, style)
                kept = True
            if interrupts.heard and not made.interrupted:
                raise KeyboardInterrupt
            product = made.measure(listener)
            summary = product.report(
                load_seconds=watch.timings["load"], write_seconds=watch.timings["write"],
                files=files, names=(str(mesh), str(output)),
            )  # fmt: skip
            with interrupts.held():
                if report is not None:
                    write_report(summary, report)
                reported = True
            if pictures is not None:
                product.write_pictures(pictures, mesh.name, summary)
        except KeyboardInterrupt:
            if not kept:
                raise
            if not reported:
                print_line(f"warning: interrupted: {output} is written, its report is not")
                return None
            if pictures is not None:
                print_line(f"warning: interrupted: {pictures} may lack pictures")
        return summary

    run_and_show(run, mesh.name, debug=debug, strict=strict and not dry_run)


def _check_embedding(mesh: Path, output: Path, *, levels: bool) -> None:
    if levels:
        raise OptionError(
            "levels of detail are not written with the original",
            where="with original",
            remedy="leave one of the two options out",
        )
    if mesh.is_file():  # else reading says better what is wrong
        check_place(mesh, output)


def _foretell(path: Path, options: SimplifyOptions, *, pictures: bool) -> None:
    """Print what a run would need, stage by stage; it may be more than the limit."""
    need = estimate_memory(path, options, pictures=pictures)
    mesh = load(path, memory_limit=options.memory_limit)
    need = need.joined(estimate_memory(mesh, options, pictures=pictures))
    stages = [(f"memory: {name}", _gib(BASE_BYTES + count)) for name, count in need.stages.items()]
    limit = options.memory_limit or default_limit()
    print_rows(
        path.name,
        [
            ("triangles", f"{len(mesh.faces):,}"),
            ("vertices", f"{len(mesh.vertices):,}"),
            *stages,
            ("memory at most", _gib(need.peak)),
            ("memory limit", _gib(limit * GIB)),
        ],
        [f"it would be refused: {need.largest} needs too much"] if need.gib > limit else [],
    )


def _gib(count: float) -> str:
    return f"{count / GIB:.2f} GiB"


def _check_distinct(mesh: Path, output: Path, *, levels: bool) -> None:
    """The mesh is not to be lost by a slip of the keyboard."""
    if levels and is_level_path(mesh, output):
        raise OutputError(
            "its levels would replace or remove the mesh itself",
            where=str(output),
            remedy="name another file for the occluder",
        )
    if mesh.resolve() == output.resolve():
        raise OutputError(
            "this is the mesh itself",
            where=str(output),
            remedy="name another file for the occluder",
        )
