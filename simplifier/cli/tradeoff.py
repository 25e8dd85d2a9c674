"""The command that measures speed against accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.cli.console import print_front, print_line, print_text, run_bar
from simplifier.cli.help import OUTPUT, with_examples
from simplifier.cli.options import read_options, with_options
from simplifier.cli.overrides import NoOverrides, chosen_overrides
from simplifier.cli.running import Debug, Quiet, interrupts, run_guarded
from simplifier.errors import MeshError
from simplifier.geometry.overrides import Overrides
from simplifier.io.files import make_folder, write_whole
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.tradeoff.journal import Journal
from simplifier.tradeoff.study import Study, study_files, study_of
from simplifier.tradeoff.sweep import Trial, run_count, sweep
from simplifier.warmup import warm_up
from simplifier.wording import count

_JOURNAL = "tradeoff.journal"
"""In the folder of results, while a sweep has not ended."""


@with_examples(
    ("occluder tradeoff castle.glb -o out", "Compare presets, resolutions and times on one mesh."),
    ("occluder tradeoff a.glb b.glb -o out --budgets 32,64", "Compare two budgets on two meshes."),
    ("occluder tradeoff castle.glb -o out --times 0.5,1 --repeats 1", "Take a quick look."),
)
@with_options(TradeoffOptions)
def tradeoff(
    meshes: Annotated[
        list[Path], typer.Argument(help="The meshes: glb, gltf, obj, ply, stl, off, 3mf, dae.")
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Folder for tradeoff.csv, .json, .png and .html.",
            rich_help_panel=OUTPUT,
        ),
    ],
    *,
    no_overrides: NoOverrides = False,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Measure speed against accuracy over many settings: a table, a picture and a page.

    This takes some minutes for each mesh. Press Ctrl-C to stop and keep what was measured so far.
    The same command goes on from there, also after a crash.
    """

    def run() -> None:
        options = read_options(TradeoffOptions, chosen)
        make_folder(output)
        with interrupts() as listening:
            journal = Journal.open(output / _JOURNAL, options)
            if len(journal):
                print_text(f"going on after {count(len(journal), 'run')} that were kept")
            trials = _trials(meshes, options, no_overrides, journal)
            study = study_of(trials, options, options.precision)
            with listening.deferred():  # what was measured is not to be lost to a late Ctrl-C
                for name, data in study_files(study):
                    with listening.held():
                        write_whole(output / name, data)
                if not listening.heard:
                    journal.end()
                _print_study(study)
        if all(trial.failure for trial in trials):
            remedy = f"tradeoff.csv in {output} says why"
            raise MeshError("none of the meshes could be measured", remedy=remedy)
        if listening.heard:
            runs = f"{len(trials):,} of {run_count(meshes, options):,} runs"
            rest = "the same command continues from there"
            print_line(f"warning: interrupted after {runs}; {output} holds what they gave; {rest}")

    run_guarded(run, debug=debug, quiet=quiet)


def _trials(
    meshes: list[Path], options: TradeoffOptions, no_overrides: bool, journal: Journal
) -> list[Trial]:
    """All trials, or those up to Ctrl-C if there are any."""

    def overrides_of(mesh: Path) -> Overrides:
        return chosen_overrides(mesh, None, no_overrides)

    trials: list[Trial] = []
    try:
        with run_bar(run_count(meshes, options)) as tell:
            warm_up()
            for trial in sweep(meshes, options, tell, overrides_of, journal):
                trials.append(trial)  # noqa: PERF402  what came before Ctrl-C must be kept
    except KeyboardInterrupt:
        if not trials:
            raise
    return trials


def _print_study(study: Study) -> None:
    for line in study.warnings:
        print_line(f"warning: {line}")
    for title, rows in study.fronts:
        print_front(title, rows)
    for line in study.lines:
        print_text(line)
