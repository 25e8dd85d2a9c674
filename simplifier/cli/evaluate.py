"""The command that judges an occluder against its mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.api import evaluate as measure
from simplifier.cli.help import with_examples
from simplifier.cli.options import Mesh, PicturesFolder, ReportFile, read_options, with_options
from simplifier.cli.overrides import NoOverrides, OverridesFile, chosen_overrides
from simplifier.cli.report import Outcome, Shown, Strict, check_extras, run_and_show
from simplifier.cli.running import AsJson, Debug, Interrupts, Quiet, Verbose
from simplifier.io.load import load, load_occluder
from simplifier.io.suffixes import overrides_place
from simplifier.options.simplify import EvaluateOptions
from simplifier.production.estimate import check_file
from simplifier.progress import Listener, Stopwatch
from simplifier.report.page import PAGE
from simplifier.report.report import write_report


@with_examples(
    ("occluder evaluate castle.glb castle_occluder.glb", "Print precision, recall and a verdict."),
    (
        "occluder evaluate castle.glb castle_occluder.glb --pictures pictures",
        "Also draw where the occluder hides too little or too much.",
    ),
    (
        "occluder evaluate castle.glb castle_occluder.glb --exact --json",
        "Measure exactly, and print the figures as JSON.",
    ),
)
@with_options(EvaluateOptions)
def evaluate(
    mesh: Mesh,
    occluder: Annotated[
        Path, typer.Argument(help="The occluder to judge, in any of these formats.")
    ],
    *,
    overrides: OverridesFile = None,
    no_overrides: NoOverrides = False,
    report: ReportFile = None,
    pictures: PicturesFolder = None,
    as_json: AsJson = False,
    strict: Strict = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Judge an occluder, made here or elsewhere, against its mesh.

    The resolution, --up, --ground and --smallest-hole decide what counts as inside the mesh. Only
    the deviation depends on them. --viewers also decides where the occluder is judged from.
    """

    def run(listener: Listener, interrupts: Interrupts) -> Outcome:
        options = read_options(EvaluateOptions, chosen)
        others = [
            (mesh, "the mesh itself"),
            (occluder, "the occluder itself"),
            (overrides or overrides_place(mesh), "the file of overrides"),
        ]
        check_extras(report, pictures, others)
        by_hand = chosen_overrides(mesh, overrides, no_overrides)
        check_file(mesh, options, pictures=pictures is not None)
        watch, limit = Stopwatch(listener), options.memory_limit
        with watch.stage("load"):
            soup = load(
                mesh,
                transparent=options.transparent,
                ignore=by_hand.ignore,
                memory_limit=limit,
            )
            judged = load_occluder(occluder, memory_limit=limit)
        found = measure(soup, judged, options, listener=listener, overrides=by_hand)
        summary = found.report(load_seconds=watch.timings["load"], names=(str(mesh), str(occluder)))
        if report is not None:
            write_report(summary, report)
        if pictures is not None:
            found.write_pictures(pictures, mesh.name, summary)
        return Outcome(summary, then="" if pictures is None else f"open {pictures / PAGE}")

    shown = Shown(strict=strict, verbose=verbose, quiet=quiet, as_json=as_json, debug=debug)
    run_and_show(run, f"{mesh.name}, {occluder.name}", shown)
