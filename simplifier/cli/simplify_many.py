"""Several meshes in one call of ``occluder simplify``: one start, all processors, a line a mesh."""

from __future__ import annotations

import tempfile
from collections import Counter, deque
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import typer

from simplifier.builds.batch import batch_jobs, places_of
from simplifier.builds.build import answers_here
from simplifier.builds.finding import AssetFigures
from simplifier.builds.making import AssetJob, MadeAsset, mesh_stamp, put_in_place
from simplifier.builds.outputs import is_template
from simplifier.cli.console import count_bar, print_json_line, print_line, print_report, print_text
from simplifier.cli.current import Making
from simplifier.cli.findings import figures_line
from simplifier.cli.options import read_options
from simplifier.cli.overrides import overrides_used
from simplifier.cli.report import Shown
from simplifier.cli.running import INTERRUPTED, Interrupts, interrupts, run_guarded
from simplifier.errors import OccluderError, OptionError, OutputError
from simplifier.io.glb_embed import check_place
from simplifier.io.places import is_folder, is_there
from simplifier.io.save import check_format, remove_levels
from simplifier.options.simplify import SimplifyOptions, Style, WriteOptions
from simplifier.processes import Answer
from simplifier.report.report import Report
from simplifier.wording import verdict_words


@dataclass(frozen=True)
class Asked:
    """What was typed beside the meshes and how much is shown.

    ``chosen``     values of :class:`SimplifyOptions` and :class:`WriteOptions`.
    ``refused``    options that were given and are of one mesh.
    ``overrides``  whether those beside the meshes count.
    ``force``      whether what is current is made again.
    """

    output: Path
    chosen: Mapping[str, Any]
    refused: Sequence[str]
    overrides: bool
    force: bool

    @cached_property
    def options(self) -> SimplifyOptions:
        return read_options(SimplifyOptions, self.chosen)

    @cached_property
    def writing(self) -> WriteOptions:
        return read_options(WriteOptions, self.chosen)


@dataclass(frozen=True)
class MeshOutcome:
    """What came of a mesh: a report, or in words why there is none."""

    mesh: Path
    place: Path
    state: str
    report: Report | None = None
    failure: str = ""

    @property
    def good(self) -> bool:
        return self.report is not None and self.report["verdict"]["word"] == "good"


def simplify_many(meshes: Sequence[Path], asked: Asked, shown: Shown) -> None:
    """Make the occluder of each mesh and tell of it, in the order in which they were named.

    Exits with status 1 where one fails or, if that is asked for, is not good, and with 130 where
    the run was interrupted: what was made until then is kept, and is current for the next run.
    """
    status = 0

    def run() -> None:
        nonlocal status
        with interrupts() as listening:
            outcomes = []
            places = _places(meshes, asked)
            with closing(_outcomes(places, asked, listening)) as found:
                for outcome in found:
                    with listening.held():
                        _tell(outcome, shown)
                    outcomes.append(outcome)
            with listening.held():
                print_text(_headline(outcomes))
                failed = any(one.report is None for one in outcomes)
                short = shown.strict and not all(one.good for one in outcomes)
                status = 1 if failed or short else 0
                if len(outcomes) < len(places):
                    done = f"{len(outcomes):,} of {len(places):,} meshes are done"
                    print_line(f"error: interrupted; {done}, run it again for the rest")
                    status = INTERRUPTED

    run_guarded(run, debug=shown.debug, quiet=shown.quiet, as_json=shown.as_json)
    if status:
        raise typer.Exit(status)


def _places(meshes: Sequence[Path], asked: Asked) -> Mapping[Path, Path]:
    """Where each mesh goes.  Raises where the call as a whole cannot be followed."""
    for name in asked.refused:
        raise OptionError(
            "cannot be given for several meshes, a folder or a path with fields",
            where=name,
            remedy=_INSTEAD[name],
        )
    options, writing = asked.options, asked.writing
    if writing.with_original is not None and options.levels is not None:
        raise OptionError(
            "levels of detail are not written with the original",
            where="with original",
            remedy="leave one of the two options out",
        )
    if is_there(asked.output) and not is_folder(asked.output) and not is_template(asked.output):
        raise OutputError(
            "this is not a folder",
            where=str(asked.output),
            remedy="name one, or a file with a suffix, as in occluder.glb",
        )
    places = places_of(meshes, asked.output, options)
    for place in places.values():
        check_format(place, Style(writing.sides, writing.as_quads))
    return places


_INSTEAD = {
    "overrides": "put a file MESH.overrides.toml beside each mesh",
    "report": "take --json, which prints a line with the report of each mesh",
    "pictures": "make those of a mesh by itself, or by occluder evaluate",
    "dry-run": "ask about the largest mesh by itself",
}


def _outcomes(
    places: Mapping[Path, Path], asked: Asked, listening: Interrupts
) -> Generator[MeshOutcome, None, None]:
    """One of each mesh, in their order, as soon as those before it are known; until Ctrl-C."""
    known: dict[Path, MeshOutcome] = {}
    makings: dict[Path, Making] = {}
    for mesh, place in places.items():
        found = _looked_up(mesh, place, asked)
        if isinstance(found, Making):
            makings[mesh] = found
        else:
            known[mesh] = found
    waiting = deque(places)
    with closing(_made({mesh: places[mesh] for mesh in makings}, asked, listening)) as answers:
        while waiting:
            if waiting[0] in known:
                yield known[waiting.popleft()]
                continue
            answered = next(answers, None)
            if answered is None:  # interrupted
                break
            job, answer = answered
            with listening.held():
                known[job.mesh] = _settled(job, answer, makings[job.mesh])
    yield from (known[mesh] for mesh in waiting if mesh in known)


def _looked_up(mesh: Path, place: Path, asked: Asked) -> Making | MeshOutcome:
    """What is to be made of a mesh, or what is known of it without: it is current, or it fails."""
    options, writing = asked.options, asked.writing
    try:
        if writing.with_original is not None:
            check_place(mesh, place)
        used = overrides_used(mesh, None, not asked.overrides)
        making = Making.of(mesh_stamp(mesh), place, used, options, writing)
    except OccluderError as error:
        return MeshOutcome(mesh, place, "failed", failure=str(error))
    report = None if asked.force else making.current()
    return making if report is None else MeshOutcome(mesh, place, "current", report)


def _made(
    places: Mapping[Path, Path], asked: Asked, listening: Interrupts
) -> Generator[tuple[AssetJob, Answer], None, None]:
    """Each mesh with what processes have to say of it, in any order."""
    if not places:
        return
    options, writing = asked.options, asked.writing
    with (
        tempfile.TemporaryDirectory(prefix="occluder-") as scratch,
        listening.deferred() as cancel,
        count_bar("occluders") as tell,
    ):
        jobs = batch_jobs(places, options, writing, Path(scratch), overrides=asked.overrides)
        tell(0, len(jobs))
        with closing(answers_here(jobs, None, cancel)) as outcomes:
            for done, outcome in enumerate(outcomes, start=1):
                yield jobs[outcome.job], outcome.answer
                tell(done, len(jobs))


def _settled(job: AssetJob, answer: Answer, making: Making) -> MeshOutcome:
    """Put what was made in place and remember it."""
    (target,) = job.targets
    made = answer.result
    if not isinstance(made, MadeAsset):
        failure = answer.failure.replace(str(target.draft), str(target.place))
        return MeshOutcome(job.mesh, target.place, "failed", failure=failure)
    report = dict(made.report)
    try:
        files = put_in_place(job)
        if job.options.levels is not None:
            remove_levels(target.place, len(report["levels"]))
    except OutputError as error:
        return MeshOutcome(job.mesh, target.place, "failed", failure=str(error))
    making.keep(files, report)
    return MeshOutcome(job.mesh, target.place, "made", report)


def _tell(outcome: MeshOutcome, shown: Shown) -> None:
    name, report = str(outcome.mesh), outcome.report
    row = {"mesh": name, "output": str(outcome.place), "state": outcome.state}
    print_json_line({**row, "report": report} if report else {**row, "error": outcome.failure})
    if report is None:
        where = "" if outcome.failure.startswith(name) else f"{name}: "
        print_line(f"error: {where}{outcome.failure}")
        return
    if shown.verbose:
        made = f"{outcome.state}: {outcome.place}"
        print_report(report, outcome.mesh.name, made=made, verbose=True)
    else:
        verdict = report["verdict"]
        not_good = [] if outcome.good else [verdict_words(verdict)]
        print_text(f"{name}: {outcome.place}, {figures_line(AssetFigures.of(report))}")
        for warning in [*not_good, *report["warnings"]]:
            print_line(f"warning: {name}: {warning}")
    if shown.strict and not outcome.good:
        print_line(f"error: {name}: the occluder is not good")


def _headline(outcomes: Sequence[MeshOutcome]) -> str:
    """``"3 meshes: 1 made, 1 current, 1 failed; 2 good"``."""
    states = Counter(one.state for one in outcomes)
    verdicts = Counter(one.report["verdict"]["word"] for one in outcomes if one.report)
    meshes = "1 mesh" if len(outcomes) == 1 else f"{len(outcomes):,} meshes"
    groups = (
        ", ".join(f"{counts[word]:,} {word}" for word in words if counts[word])
        for counts, words in (
            (states, ("made", "current", "failed")),
            (verdicts, ("good", "weak", "unusable")),
        )
    )
    return f"{meshes}: {'; '.join(filter(None, groups)) or 'none made'}"
