"""The command line: ``occluder``.

Exit status: 0 done, 1 the input or the run failed, 2 wrong usage, 130 interrupted with nothing
kept.  A failure is one line on standard error that says what, where and what to do; ``--debug``
adds the traceback.
"""

from __future__ import annotations

import atexit
import gc
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier import cli_cull, cli_scene
from simplifier.cli_failures import Debug, guarded
from simplifier.console import (
    accept_any_text,
    print_front,
    print_line,
    print_report,
    print_text,
    progress_bar,
    run_bar,
)
from simplifier.errors import MeshError, OutputError
from simplifier.evaluation.accuracy import (
    AccuracyOptions,
    AccuracyReport,
    evaluate_accuracies,
    evaluate_accuracy,
)
from simplifier.evaluation.level_report import left_out_rows, level_rows
from simplifier.evaluation.page import write_pictures
from simplifier.evaluation.report import Report, build_report, write_report
from simplifier.evaluation.tradeoff import SweepOptions, Trial, run_count, sweep
from simplifier.evaluation.tradeoff_cases import check_precision
from simplifier.evaluation.tradeoff_study import Study, numbers, study_files, study_of
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.interrupts import INTERRUPTED, Interrupts, interrupts
from simplifier.io import check_writable, load_mesh, load_occluder, save_lods, save_occluder
from simplifier.io.save_lods import is_level_path
from simplifier.io.whole import check_folder, make_folder, write_whole
from simplifier.lods.levels import Levels, simplify_levels
from simplifier.lods.plan import finest_bound, plan_levels, typed_lods
from simplifier.options import (
    MOST_VOXELS,
    Axis,
    LodOptions,
    Options,
    Preset,
    Slicing,
    Trim,
    Viewers,
    make_options,
)
from simplifier.pipeline import Simplification, simplify_mesh
from simplifier.progress import Cancel, Listener, Stopwatch
from simplifier.solidify import solidify
from simplifier.version import VERSION
from simplifier.warmup import warm_up

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)

Mesh = Annotated[Path, typer.Argument(help="The mesh: glb, gltf, obj, ply, stl or off.")]
Resolution = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_VOXELS, help="Voxels along the longest edge.", show_default="64"),
]
Up = Annotated[Axis, typer.Option(help="The mesh's up axis: x, y or z.")]
Ground = Annotated[
    bool, typer.Option("--ground", help="The mesh stands on the ground: close its open base.")
]
WhoLooks = Annotated[
    Viewers,
    typer.Option(
        help="Where viewers can be: all, or above (looking level or down; on the ground)."
    ),
]
SmallestHole = Annotated[
    float,
    typer.Option(help="Openings narrower than this count as closed, in the mesh's units."),
]
Views = Annotated[int, typer.Option(help="Views that accuracy is measured from.")]
Image = Annotated[int, typer.Option(help="Pixels a side of each view.")]
Quads = Annotated[int, typer.Option(help="Random quads in each view.")]
Exact = Annotated[bool, typer.Option("--exact", help="Count all quads in place of a sample.")]
Seed = Annotated[int, typer.Option(help="Seed of everything random.")]
ReportFile = Annotated[Path | None, typer.Option("--report", help="Write the report as JSON.")]


@app.command()
def simplify(
    mesh: Mesh,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="The occluder: glb, obj, ply, stl or tres.")
    ],
    budget: Annotated[int, typer.Option(help="Most triangles of the occluder.")] = 64,
    resolution: Resolution = None,
    error_bound: Annotated[
        float | None,
        typer.Option(help="In place of a resolution: largest deviation, in the mesh's units."),
    ] = None,
    lods: Annotated[
        int | None,
        typer.Option(help="Levels of detail, each of half the resolution and half the budget."),
    ] = None,
    error_bounds: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Levels of detail by their error bounds in its place."),
    ] = None,
    pixel_error: Annotated[
        float | None,
        typer.Option(help="Pixels that a level's error may have.", show_default="1"),
    ] = None,
    screen_height: Annotated[
        int | None, typer.Option(help="Of the screen, in pixels.", show_default="1080")
    ] = None,
    fov: Annotated[
        float | None, typer.Option(help="Vertical field of view, degrees.", show_default="60")
    ] = None,
    up: Up = "y",
    ground: Ground = False,
    viewers: WhoLooks = "all",
    smallest_hole: SmallestHole = 0.0,
    conservative: Annotated[
        bool,
        typer.Option("--conservative", help="Keep wholly inside: never hide too much if closed."),
    ] = False,
    shrink: Annotated[
        float,
        typer.Option(
            help="Keep this deep inside, in the mesh's units: what is hidden from a point is "
            "hidden from all points this near to it."
        ),
    ] = 0.0,
    trim: Annotated[
        Trim, typer.Option(help="How the budget is met: gain, or area as published.")
    ] = "gain",
    alpha: Annotated[
        float, typer.Option(help="Stop adding polygons that raise the measure by less than this.")
    ] = 0.001,
    slicer: Annotated[
        Slicing, typer.Option(help="cpu, or gl for the OpenGL stencil buffer.")
    ] = "cpu",
    preset: Annotated[
        Preset, typer.Option(help="How much time to spend: draft, balanced or best.")
    ] = "balanced",
    min_precision: Annotated[
        float, typer.Option(help="Precision to aim for at least; more of it hides less.")
    ] = 0.995,
    moves: Annotated[
        int | None,
        typer.Option(help="Refining moves; 0 leaves the cut as it is.", show_default="by preset"),
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(
            help="Seconds to spend, in place of moves: less shortens the preset's work, more goes "
            "on refining. Reading the mesh and the report come on top. Results differ from run to "
            "run.",
            show_default="by preset",
        ),
    ] = None,
    seed: Seed = 0,
    report: ReportFile = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Write pictures and an HTML report to this folder.")
    ] = None,
    views: Views = 256,
    image: Image = 256,
    quads: Quads = 32_000,
    exact: Exact = False,
    debug: Debug = False,
) -> None:
    """Make an occluder from a mesh and report its precision and recall.

    With levels of detail the output holds all of them if it is a glb, and each goes to a file of
    its own, NAME_lod0 and so on; levels that bring nothing are left out.

    Ctrl-C ends the refining and keeps the best so far; once more ends the command at once.
    """

    def run(listener: Listener, interrupts: Interrupts) -> Report | None:
        accuracy_options = AccuracyOptions(views, image, quads, seed, exact, viewers, up)
        levels = typed_lods(lods, error_bounds, pixel_error, screen_height, fov)
        bound = error_bound
        if levels is not None:
            bound = finest_bound(levels, resolution, error_bound)
        check_writable(output)
        _check_distinct(mesh, output, levels)
        _check_extras(report, pictures)
        watch = Stopwatch(listener)
        with watch.stage("load"):
            soup = load_mesh(mesh)
        options = make_options(
            float(soup.extent.max()), budget=budget, resolution=resolution,
            error_bound=bound, up=up, ground=ground, viewers=viewers,
            smallest_hole=smallest_hole, conservative=conservative, shrink=shrink,
            trim=trim, slicer=slicer, alpha=alpha, preset=preset,
            min_precision=min_precision, moves=moves, time_limit=time_limit, seed=seed,
        )  # fmt: skip
        kept = reported = False
        try:
            with interrupts.deferred() as cancel:
                result = _made(soup, options, levels, listener, cancel)
                with interrupts.held(), watch.stage("write"):
                    files = _written(result, output)
                kept = True
            if interrupts.heard and not result.interrupted:
                raise KeyboardInterrupt
            with watch.stage("accuracy"):
                accuracies = evaluate_accuracies(soup, _occluders(result), accuracy_options)
            accuracy = accuracies[0]
            summary = build_report(
                soup, result.occluder, result.solid, accuracy,
                options=_resolved(options, levels, accuracy_options),
                timings=_timings(result, watch), warnings=result.warnings, seed=seed,
                **_level_keys(result, accuracies, files),
            )  # fmt: skip
            with interrupts.held():
                _write_report(summary, report)
                reported = True
            _write_pictures(pictures, summary, mesh.name, (soup, result.occluder, accuracy))
        except KeyboardInterrupt:
            if not kept:
                raise
            if not reported:
                print_line(f"warning: interrupted: {output} is written, its report is not")
                return None
            if pictures is not None:
                print_line(f"warning: interrupted: {pictures} may lack pictures")
        return summary

    _run(run, mesh.name, debug=debug)


@app.command()
def evaluate(
    mesh: Mesh,
    occluder: Annotated[Path, typer.Argument(help="The occluder to judge.")],
    resolution: Resolution = None,
    up: Up = "y",
    ground: Ground = False,
    viewers: WhoLooks = "all",
    smallest_hole: SmallestHole = 0.0,
    seed: Seed = 0,
    report: ReportFile = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Write pictures and an HTML report to this folder.")
    ] = None,
    views: Views = 256,
    image: Image = 256,
    quads: Quads = 32_000,
    exact: Exact = False,
    debug: Debug = False,
) -> None:
    """Judge an occluder, made here or elsewhere, against its mesh.

    Resolution, up, ground and smallest hole say what counts as the mesh's inside, for the deviation
    alone; viewers say where it is judged from as well.
    """

    def run(listener: Listener, interrupts: Interrupts) -> Report:
        accuracy_options = AccuracyOptions(views, image, quads, seed, exact, viewers, up)
        _check_extras(report, pictures)
        watch = Stopwatch(listener)
        with watch.stage("load"):
            soup, judged = load_mesh(mesh), load_occluder(occluder)
        options = make_options(
            float(soup.extent.max()), resolution=resolution, up=up, ground=ground,
            viewers=viewers, smallest_hole=smallest_hole,
        )  # fmt: skip
        solid = solidify(soup, options.solid, watch)
        with watch.stage("accuracy"):
            accuracy = evaluate_accuracy(soup, judged, accuracy_options)
        summary = build_report(
            soup, judged, solid, accuracy,
            options={
                **asdict(options.solid), "viewers": viewers, "accuracy": asdict(accuracy_options),
            },
            timings=watch.timings, seed=seed,
        )  # fmt: skip
        _write_report(summary, report)
        _write_pictures(pictures, summary, mesh.name, (soup, judged, accuracy))
        return summary

    _run(run, f"{mesh.name}, {occluder.name}", debug=debug)


@app.command()
def tradeoff(
    meshes: Annotated[
        list[Path], typer.Argument(help="The meshes: glb, gltf, obj, ply, stl, off.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for tradeoff.csv, .png and .html.")
    ],
    resolutions: Annotated[
        str, typer.Option(metavar="LIST", help="Resolutions to try.")
    ] = "32,64,128",
    directions: Annotated[
        str, typer.Option(metavar="LIST", help="Section directions to try.")
    ] = "16,32,128",
    budgets: Annotated[
        str, typer.Option(metavar="LIST", help="Budgets, each with a front of its own.")
    ] = ("16,64,256"),
    times: Annotated[
        str, typer.Option(metavar="LIST", help="Times to try, seconds.")
    ] = "0.25,0.5,1,2,5",
    precision: Annotated[
        float, typer.Option(help="Least precision, 0 to 1, of a setting on the front.")
    ] = 0.99,
    up: Up = "y",
    ground: Ground = False,
    seed: Seed = 0,
    repeats: Annotated[int, typer.Option(help="Runs a setting; their median time counts.")] = 3,
    full: Annotated[
        bool, typer.Option("--full", help="Every combination, not one knob at a time.")
    ] = False,
    debug: Debug = False,
) -> None:
    """Measure speed against accuracy over many settings: a table, a picture and a page.

    Takes some minutes a mesh.  Ctrl-C ends it and keeps what was measured so far.
    """

    def run() -> None:
        options = SweepOptions(
            numbers("resolutions", resolutions, int), numbers("directions", directions, int),
            numbers("budgets", budgets, int), numbers("times", times, float),
            up, ground, seed, repeats, full,
        )  # fmt: skip
        check_precision(precision)
        make_folder(output)
        with interrupts() as listening:
            trials = _trials(meshes, options)
            study = study_of(trials, options, precision)
            with listening.deferred():  # what was measured is not to be lost to a late Ctrl-C
                for name, data in study_files(study):
                    with listening.held():
                        write_whole(output / name, data)
                _print_study(study)
        if all(trial.failure for trial in trials):
            remedy = f"tradeoff.csv in {output} says why"
            raise MeshError("none of the meshes could be measured", remedy=remedy)
        if listening.heard:
            runs = f"{len(trials)} of {run_count(meshes, options)} runs"
            print_line(f"warning: interrupted after {runs}; {output} holds what they gave")

    guarded(run, debug=debug)


def _trials(meshes: list[Path], options: SweepOptions) -> list[Trial]:
    """All trials, or those up to Ctrl-C if there are any."""
    trials: list[Trial] = []
    try:
        with run_bar(run_count(meshes, options)) as tell:
            warm_up()
            for trial in sweep(meshes, options, tell):
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


app.command("path")(cli_scene.path)
app.command("scene")(cli_scene.scene)
app.command("cull")(cli_cull.cull)


@app.command()
def warmup(debug: Debug = False) -> None:
    """Compile and cache the kernels, so that the next start need not."""
    guarded(warm_up, debug=debug)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(VERSION)
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Make occluders: a handful of triangles that hide nearly what a mesh hides."""


def _run(work: Callable[[Listener, Interrupts], Report | None], name: str, *, debug: bool) -> None:
    """Run a command under a progress bar and show its report, if there is one."""

    def shown() -> None:
        with interrupts() as listening:
            with progress_bar() as listener:
                report = work(listener, listening)
            with listening.held():
                if report is not None:
                    print_report(report, name)

    guarded(shown, debug=debug)


def _made(
    soup: TriangleMesh,
    options: Options,
    levels: LodOptions | None,
    listener: Listener,
    cancel: Cancel,
) -> Simplification | Levels:
    if levels is None:
        return simplify_mesh(soup, options, listener, cancel)
    plan = plan_levels(float(soup.extent.max()), options, levels)
    return simplify_levels(soup, plan, listener, cancel)


def _written(result: Simplification | Levels, output: Path) -> tuple[Path, ...]:
    """The files of the occluders, finest first."""
    if isinstance(result, Levels):
        return save_lods(result.chain, output)
    save_occluder(result.occluder, output)
    return (output,)


def _occluders(result: Simplification | Levels) -> list[Occluder]:
    if isinstance(result, Levels):
        return [level.occluder for level in result.chain.levels]
    return [result.occluder]


def _timings(result: Simplification | Levels, watch: Stopwatch) -> dict[str, float]:
    """Seconds by stage; the levels were judged as they were made, too."""
    timings = dict(result.timings if isinstance(result, Levels) else result.occluder.timings)
    for stage, seconds in watch.timings.items():
        timings[stage] = timings.get(stage, 0.0) + seconds
    return timings


def _level_keys(
    result: Simplification | Levels, accuracies: Sequence[AccuracyReport], files: Sequence[Path]
) -> dict[str, Any]:
    """What the report says of levels of detail."""
    if not isinstance(result, Levels):
        return {}
    chain = result.chain
    return {"levels": level_rows(chain, accuracies, files), "left_out": left_out_rows(chain)}


def _check_distinct(mesh: Path, output: Path, levels: LodOptions | None) -> None:
    """The mesh is not to be lost by a slip of the keyboard."""
    if levels is not None and is_level_path(mesh, output):
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


def _check_extras(report: Path | None, pictures: Path | None) -> None:
    """Refuse now what could not be written after all the work."""
    if report is not None:
        check_folder(report)
    if pictures is not None and pictures.exists() and not pictures.is_dir():
        raise OutputError(
            "this is no folder", where=str(pictures), remedy="name one for the pictures"
        )


def _write_report(summary: Report, report: Path | None) -> None:
    if report is not None:
        write_report(summary, report)


def _write_pictures(
    pictures: Path | None,
    summary: Report,
    name: str,
    scene: tuple[TriangleMesh, Occluder, AccuracyReport],
) -> None:
    if pictures is not None:
        write_pictures(pictures, *scene, summary, name=name)


def _resolved(
    options: Options, levels: LodOptions | None, accuracy: AccuracyOptions
) -> dict[str, Any]:
    """Every option that had a part in the result, by the name that users type."""
    return {
        **asdict(options.solid),
        "viewers": options.viewers,
        **asdict(options.sections),
        **asdict(options.selection),
        "refine": asdict(options.refine),
        "time_limit": options.time_limit,
        "lods": None if levels is None else asdict(levels),
        "accuracy": asdict(accuracy),
    }


_UsageError: Any = typer.BadParameter.__bases__[0]
"""Wrong usage in general: click's class, or that of the copy that newer typers bring along."""


_OBJECTS_BETWEEN_COLLECTIONS = 200_000


def main() -> None:
    """The entry point of the ``occluder`` command."""
    accept_any_text()
    # Large scenes are a million small objects, none of them garbage: looking through them again
    # and again took a sixth of a build in which nothing had changed.
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # all is done by then
    try:
        status = app(standalone_mode=False)
    except (typer.Abort, KeyboardInterrupt):  # Ctrl-C before the command has begun
        print_line("error: interrupted; nothing was kept")
        status = INTERRUPTED
    except _UsageError as error:
        message = error.format_message().rstrip(".")
        if message:  # else the help has been shown, for want of arguments
            command = error.ctx.command_path if error.ctx else "occluder"
            print_line(f"error: {message}; see '{command} --help'")
        status = error.exit_code
    sys.exit(status)
