"""The command that makes an occluder from a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.api import simplify as simplify_soup
from simplifier.builds.making import mesh_stamp
from simplifier.builds.outputs import is_for_many
from simplifier.cli.console import print_line, print_rows
from simplifier.cli.current import Making
from simplifier.cli.help import OUTPUT, with_examples
from simplifier.cli.options import PicturesFolder, ReportFile, read_options, with_options
from simplifier.cli.overrides import NoOverrides, OverridesFile, chosen_overrides, overrides_used
from simplifier.cli.report import Outcome, Shown, Strict, check_extras, run_and_show
from simplifier.cli.running import AsJson, Debug, Interrupts, Quiet, Verbose
from simplifier.errors import OptionError, OutputError
from simplifier.io.files import check_apart
from simplifier.io.glb_embed import check_place
from simplifier.io.load import load
from simplifier.io.places import is_file
from simplifier.io.save import check_writable, holds_levels, is_level_path
from simplifier.io.suffixes import overrides_place
from simplifier.memory.limit import default_limit
from simplifier.memory.need import BASE_BYTES, GIB
from simplifier.options.simplify import SimplifyOptions, Style, WriteOptions
from simplifier.production.estimate import check_file, estimate_memory
from simplifier.production.next_try import look_command
from simplifier.progress import Listener, Stopwatch
from simplifier.report.page import PAGE
from simplifier.report.report import Report, write_report
from simplifier.wording import count, distance_advice


@with_examples(
    (
        "occluder simplify castle.glb -o castle_occluder.glb",
        "Make an occluder of at most 64 triangles.",
    ),
    (
        "occluder simplify castle.glb -o castle_occluder.glb --preset best --pictures pictures",
        "Take more time, and draw what the occluder hides.",
    ),
    (
        "occluder simplify castle.glb -o castle_occluder.glb --lods 3 --pixel-error 2",
        "Make three levels of detail for distant views.",
    ),
)
@with_options(SimplifyOptions, WriteOptions)
def simplify(
    meshes: Annotated[
        list[Path],
        typer.Argument(
            metavar="MESH...",
            help="The mesh, or several: glb, gltf, obj, ply, stl, off, 3mf or dae.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="The file to write: glb, occ, obj, ply, off, stl or tres. Of several meshes a"
            " folder, or a path with {name}, {folder} and {suffix} of each.",
            rich_help_panel=OUTPUT,
        ),
    ],
    *,
    overrides: OverridesFile = None,
    no_overrides: NoOverrides = False,
    report: ReportFile = None,
    pictures: PicturesFolder = None,
    as_json: AsJson = False,
    strict: Strict = False,
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Make the occluder even if it is current.", rich_help_panel=OUTPUT
        ),
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Print how much memory the run would need, and make nothing.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make an occluder from a mesh and report its precision and recall.

    An output that is current is left as it is, and its figures are printed again.

    With levels of detail, each level goes to a file of its own: NAME_lod0 and so on. A glb or occ
    file NAME holds all of them as well. Levels that bring nothing are left out.

    Several meshes are made at a time, one on each processor. A folder then has NAME_occluder.glb of
    each, one that fails costs no other, and --json prints one object a line.

    Press Ctrl-C to end the search and keep the best occluder so far. Press it twice to stop at
    once. Of several meshes those that are done are kept.
    """
    shown = Shown(strict and not dry_run, verbose, quiet, as_json, debug)
    if str(output) == "-":
        raise typer.BadParameter("occluders go to files: name one", param_hint="'--output'")
    if len(meshes) > 1 or is_for_many(output):
        from simplifier.cli.simplify_many import Asked, simplify_many  # what one mesh need not load

        of_one = {"overrides": overrides, "report": report, "pictures": pictures,
                  "dry-run": dry_run or None}  # fmt: skip
        refused = [name for name, value in of_one.items() if value is not None]
        asked = Asked(output, chosen, refused, not no_overrides, force)
        simplify_many(meshes, asked, shown)
        return
    (mesh,) = meshes

    def run(listener: Listener, interrupts: Interrupts) -> Outcome | None:
        options = read_options(SimplifyOptions, chosen)
        writing = read_options(WriteOptions, chosen)
        style = Style(writing.sides, writing.as_quads)
        check_writable(output, style)
        if writing.with_original is not None:
            _check_embedding(mesh, output, levels=options.levels is not None)
        _check_distinct(mesh, output, report, levels=options.levels is not None)
        others = [
            (mesh, "the mesh itself"),
            (output, "the occluder"),
            (overrides or overrides_place(mesh), "the file of overrides"),
        ]
        check_extras(report, pictures, others)
        by_hand = chosen_overrides(mesh, overrides, no_overrides)
        if dry_run:
            _foretell(mesh, options, pictures=pictures is not None)
            return None
        check_file(mesh, options, pictures=pictures is not None)
        used = overrides_used(mesh, overrides, no_overrides)
        making = Making.of(mesh_stamp(mesh), output, used, options, writing)
        found: Report | None = None if force or pictures is not None else making.current()
        if found is not None:
            if report is not None:
                write_report(found, report)
            same = f"{_made(output, found)}; --force makes it again"
            then = _then(options, writing, mesh, output, None, found)
            return Outcome(found, same, then, current=True)
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
        if not interrupts.heard:
            whole = [output] if options.levels is not None and holds_levels(output) else []
            making.keep([*whole, *files], summary)
        return Outcome(
            summary,
            _made(output, summary),
            _then(options, writing, mesh, output, pictures, summary),
        )

    run_and_show(run, mesh.name, shown)


def _made(output: Path, report: Report) -> str:
    """What was made, and where."""
    levels = report["levels"]
    if not levels:
        triangles = count(report["triangles"], "triangle")
        return f"{output}, {triangles} in place of {report['input']['triangles']:,}"
    sizes = ", ".join(f"{level['triangles']:,}" for level in levels)
    whole = f"{output} and " if holds_levels(output) else ""
    names = ", ".join(str(output.with_name(level["file"])) for level in levels)
    return f"{whole}{names}: {count(len(levels), 'level')} of detail with {sizes} triangles"


def _finest_words(report: Report) -> str:
    """From where to where the finest of several levels is used."""
    starts = [level["switch_distance"] for level in report["levels"]]
    return f"; level 0: {distance_advice(0, starts)}" if len(starts) > 1 else ""


def _then(
    options: SimplifyOptions,
    writing: WriteOptions,
    mesh: Path,
    output: Path,
    pictures: Path | None,
    report: Report,
) -> str:
    """What to do with what was made, if it is good."""
    if pictures is not None:
        return f"open {pictures / PAGE} to see where it hides"
    if writing.with_original is not None or options.levels is not None:
        return f"load {output} in your engine{_finest_words(report)}"
    return look_command(options, (str(mesh), str(output)))


def _check_embedding(mesh: Path, output: Path, *, levels: bool) -> None:
    if levels:
        raise OptionError(
            "levels of detail are not written with the original",
            where="with original",
            remedy="leave one of the two options out",
        )
    if is_file(mesh):  # else reading says better what is wrong
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


def _check_distinct(mesh: Path, output: Path, report: Path | None, *, levels: bool) -> None:
    if levels and is_level_path(mesh, output):
        raise OutputError(
            "its levels would replace or remove the mesh itself",
            where=str(output),
            remedy="name another file for the occluder",
        )
    if levels and report is not None and is_level_path(report, output):
        raise OutputError(
            "this is a level of the occluder",
            where=str(report),
            remedy="name another file for the report",
        )
    check_apart([output], "the occluder", [(mesh, "the mesh itself")])
