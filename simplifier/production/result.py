"""What simplifying gives: an occluder or levels of detail, to be saved, measured and reported.

Saving does not wait for the measure, which takes its time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

from simplifier.accuracy.accuracy import AccuracyOptions, AccuracyReport, evaluate_accuracies
from simplifier.accuracy.deviation import deviation_from_solid
from simplifier.accuracy.front import measure_front
from simplifier.accuracy.overhang import Overhang, measure_overhangs
from simplifier.accuracy.verdict import Aim, Aims, EngineVerdict, verdict_on
from simplifier.checks import as_path, check_kind, check_one_of
from simplifier.device.choice import open_device
from simplifier.device.remembering import remembering
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.views import ViewShares
from simplifier.io.glb_embed import save_with_original
from simplifier.io.save import save_lods, save_occluder
from simplifier.lods.levels import Levels
from simplifier.options.fields import passed_on
from simplifier.options.simplify import PLAIN, Embedding, SimplifyOptions, Style
from simplifier.options.stages import Options
from simplifier.pipeline import Simplification
from simplifier.production.next_try import NAMES, Names, next_simplify
from simplifier.production.remarks import overrides_summary, remarks
from simplifier.progress import Listener, Stopwatch
from simplifier.report.page import write_pictures
from simplifier.report.report import (
    Report,
    build_report,
    left_out_rows,
    level_rows,
    verdict_figures,
    verdict_row,
)
from simplifier.wording import percent_at_most

_A_STYLE = "none, but sides and quads to simplifier.save"
_DEFAULT_OVERHANG = {one.name: one.default for one in SimplifyOptions.fields()}["overhang"]


@dataclass(frozen=True, eq=False)
class SimplifyResult:
    """What was made of a mesh; :meth:`measure` tells how good it is.

    ``stages``   the options of every stage, for the occluder or the finest level.
    ``made``     what the pipeline gave.
    """

    mesh: TriangleMesh
    options: SimplifyOptions
    stages: Options
    made: Simplification | Levels
    overrides: Overrides = NO_OVERRIDES

    @property
    def occluder(self) -> Occluder:
        """The occluder, or the finest level's."""
        return self.made.occluder

    @property
    def chain(self) -> LodChain | None:
        """The levels of detail, finest first; None for a single occluder."""
        return self.made.chain if isinstance(self.made, Levels) else None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know, a sentence each."""
        return tuple(self.made.warnings)

    @property
    def interrupted(self) -> bool:
        """Whether the run was cancelled, so that this is the best so far."""
        return self.made.interrupted

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds by stage."""
        return self.made.timings

    def save(self, path: str | Path, style: Style = PLAIN) -> tuple[Path, ...]:
        """Write in the format of the suffix, all or nothing; the files, finest level first.

        Raises :class:`~simplifier.errors.OutputError`.
        """
        check_kind("style", style, Style, _A_STYLE)
        if isinstance(self.made, Levels):
            return save_lods(self.made.chain, path, style)
        save_occluder(self.made.occluder, path, style)
        return (Path(path),)

    def save_with_original(
        self, original: str | Path, path: str | Path, how: Embedding, style: Style = PLAIN
    ) -> tuple[Path, ...]:
        """Write a GLB of the file that the mesh was read from, the occluder (the finest) in it.

        Raises :class:`~simplifier.errors.OptionError`, :class:`~simplifier.errors.OutputError` and
        :class:`~simplifier.errors.UnreadableMeshError`.
        """
        original, path = as_path("original", original), as_path("path", path)
        check_one_of("how", how, get_args(Embedding))
        check_kind("style", style, Style, _A_STYLE)
        save_with_original(original, self.mesh, self.occluder, path, how, style)
        return (path,)

    def __repr__(self) -> str:
        return f"<SimplifyResult: {self.chain or self.occluder}>"

    def measure(self, listener: Listener | None = None) -> MeasuredResult:
        """Precision, recall, overhang and a verdict, of every level."""
        watch, device = Stopwatch(listener), remembering(open_device(self.options.device))
        with watch.stage("accuracy"):
            chain = self._chain()
            occluders = [level.occluder for level in chain.levels]
            accuracies = evaluate_accuracies(
                self.mesh, occluders, passed_on(AccuracyOptions, self.options), device=device
            )
            directions = accuracies[0].directions
            overhangs = measure_overhangs(self.mesh, occluders, directions, device)
            verdicts = tuple(
                verdict_on(
                    verdict_figures(level.occluder, accuracy, overhang),
                    _aims(self.options, chain.levels[0].resolution / level.resolution),
                )
                for level, accuracy, overhang in zip(
                    chain.levels, accuracies, overhangs, strict=True
                )
            )
            front = measure_front(self.mesh, self.occluder, directions, device)
            notes = remarks(self.mesh, self.occluder, self.made.solid, self.overrides)
        taken = watch.timings["accuracy"]
        return MeasuredResult(self, chain, accuracies, overhangs, front, verdicts, taken, notes)

    def _chain(self) -> LodChain:
        if isinstance(self.made, Levels):
            return self.made.chain
        solid = self.made.solid
        strays = deviation_from_solid(self.occluder, self.mesh, solid)
        return LodChain((Level(self.occluder, self.stages.solid.resolution, strays),), Lens())


@dataclass(frozen=True, eq=False)
class MeasuredResult:
    """An occluder or levels of detail, with their precision and recall.

    ``chain``       the levels, finest first; a single occluder is a chain of one.
    ``accuracies``  one a level, in the same order.
    ``overhangs``, ``verdicts``  likewise.
    ``front``       of the finest level, the shares of pixels that it stands before.
    ``seconds``     that measuring took.
    ``remarks``     on overrides and what was left out, a sentence each.
    """

    result: SimplifyResult
    chain: LodChain
    accuracies: tuple[AccuracyReport, ...]
    overhangs: tuple[Overhang, ...]
    front: ViewShares
    verdicts: tuple[EngineVerdict, ...]
    seconds: float
    remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<MeasuredResult: {self.verdict}>"

    @property
    def mesh(self) -> TriangleMesh:
        """What it was made of."""
        return self.result.mesh

    @property
    def precision(self) -> float:
        """Share of what the finest occluder hides that the mesh hides too, over all views."""
        return self.accuracies[0].precision

    @property
    def recall(self) -> float:
        """Share of what the mesh hides that the finest occluder hides too, over all views."""
        return self.accuracies[0].recall

    @property
    def overhang(self) -> Overhang:
        """What the finest occluder covers beside the mesh."""
        return self.overhangs[0]

    @property
    def verdict(self) -> EngineVerdict:
        """Whether the finest occluder is good for an engine, and why."""
        return self.verdicts[0]

    @property
    def levels(self) -> tuple[Level, ...]:
        """At least one, finest first."""
        return self.chain.levels

    @property
    def occluder(self) -> Occluder:
        """The finest level's."""
        return self.result.occluder

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know beside the verdict, a sentence each."""
        coarser = tuple(
            f"level {index} is {verdict.word}: {verdict.reason}"
            for index, verdict in enumerate(self.verdicts)
            if index > 0 and verdict.word == "unusable"
        )
        noted = (*self.verdict.remarks, *_much_front(self.front), *coarser, *self.remarks)
        return (*self.result.warnings, *noted)

    @property
    def interrupted(self) -> bool:
        """Whether the run was cancelled, so that this is the best so far."""
        return self.result.interrupted

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds by stage; levels were judged as they were made, too."""
        timings = dict(self.result.timings)
        timings["accuracy"] = timings.get("accuracy", 0.0) + self.seconds
        return timings

    def save(self, path: str | Path, style: Style = PLAIN) -> tuple[Path, ...]:
        """As :meth:`SimplifyResult.save`."""
        return self.result.save(path, style)

    def report(
        self,
        *,
        load_seconds: float = 0.0,
        write_seconds: float = 0.0,
        files: Sequence[Path] | None = None,
        names: Names = NAMES,
    ) -> Report:
        """What ``--report`` writes, as ``docs/report.schema.json`` says.

        ``load_seconds``, ``write_seconds``  what reading the mesh and :meth:`save` took.
        ``files``  what :meth:`save` returned; None where nothing was saved.
        ``names``  of mesh and occluder in the command to try next.
        """
        options, objects = self.result.options, self.mesh.objects
        commands = [next_simplify(options, one, names, objects) for one in self.verdicts]
        rows = [verdict_row(*one) for one in zip(self.verdicts, commands, strict=True)]
        levels = level_rows(self.chain, self.accuracies, self.overhangs, rows, files)
        return build_report(
            self.mesh, self.occluder, self.result.made.solid, self.accuracies[0],
            options=_options_row(self.result, self.accuracies[0].options),
            timings={**self.timings, "load": load_seconds, "write": write_seconds},
            warnings=self.warnings, decisions=self.result.made.decisions,
            seed=self.result.options.seed, strays=self.levels[0].deviation,
            overhang=self.overhang, front=self.front, verdict=self.verdict, command=commands[0],
            levels=levels if self.result.chain else (),
            left_out=left_out_rows(self.chain), device=open_device(self.result.options.device),
        )  # fmt: skip

    def write_pictures(
        self, folder: str | Path, name: str, report: Report | None = None
    ) -> list[Path]:
        """Write silhouettes, histograms and an HTML page about the finest level; what was written.

        ``name`` is what the page calls the mesh, ``report`` what it shows: by default a new one.
        Raises :class:`~simplifier.errors.OutputError`.
        """
        shown = self.report() if report is None else report
        return write_pictures(
            folder, self.mesh, self.occluder, self.accuracies[0], shown, name=name,
            device=open_device(self.result.options.device),
        )  # fmt: skip


def _aims(options: SimplifyOptions, distance: float) -> Aims:
    """What a level aimed for that is looked at from so many times as far as the finest there is.

    A chosen aim is one that is not as by default.
    """
    overhang = None
    if not options.wholly_inside:
        allowed = min(options.overhang * distance, 1.0)  # as the levels are made
        overhang = Aim(allowed, chosen=options.overhang != _DEFAULT_OVERHANG)
    precision = Aim(options.least_precision, chosen=options.min_precision is not None)
    return Aims(precision, overhang, distance)


_MUCH_FRONT = 0.05
"""In the mean over all views.  Standing off by a voxel, as all may, gives most meshes 2 to 4 %."""


def _much_front(front: ViewShares) -> tuple[str, ...]:
    """What to do where much that is in plain sight lies behind the finest level."""
    if front.mean <= _MUCH_FRONT:
        return ()
    return (
        f"{percent_at_most(front.mean)} of the visible mesh lies well behind the occluder, so that"
        " objects which move there vanish; lower front or overhang, raise the resolution, or keep"
        " regions open by overrides",
    )


def _options_row(result: SimplifyResult, judging: AccuracyOptions) -> dict[str, Any]:
    """Every option that had a part in the result, by the name that users type.

    ``judging``  how it was measured.
    """
    chosen, options = result.options, result.stages
    return {
        **asdict(options.solid),
        "transparent": chosen.transparent,
        "overrides": overrides_summary(result.overrides),
        **asdict(options.sections),
        **asdict(options.selection),
        "refine": asdict(options.refine),
        "time_limit": options.time_limit,
        "lods": None if chosen.levels is None else asdict(chosen.levels),
        "accuracy": asdict(judging),
    }
