"""``occluder evaluate`` as one call: an occluder, made here or elsewhere, against its mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from simplifier.accuracy.accuracy import AccuracyReport, evaluate_accuracy
from simplifier.checks import check_kind
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.occluder import AN_OCCLUDER, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.geometry.solid import Solid
from simplifier.memory.need import MeshSize
from simplifier.memory.runs import check_options, need_of_judging, need_of_solid
from simplifier.options import Options
from simplifier.production.measures import accuracy_options, judging_of
from simplifier.production.options import EvaluateOptions
from simplifier.production.remarks import overrides_summary, remarks
from simplifier.production.resolve import resolved
from simplifier.progress import Cancel, Listener, Stopwatch
from simplifier.report.page import write_pictures
from simplifier.report.report import Report, build_report
from simplifier.steps.solid import solidify


@dataclass(frozen=True, eq=False)
class Judgement:
    """How good an occluder is.

    ``resolved``  what counts as the mesh's inside, in the solid.
    ``timings``   seconds by stage.
    """

    mesh: TriangleMesh
    occluder: Occluder
    options: EvaluateOptions
    resolved: Options
    solid: Solid
    accuracy: AccuracyReport
    timings: Mapping[str, float]
    overrides: Overrides = NO_OVERRIDES

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know, a sentence each."""
        kept = Overrides(open=self.overrides.open)  # what is drawn is the occluder's own affair
        return remarks(self.mesh, self.occluder, self.solid, kept)

    def report(self, *, load_seconds: float = 0.0) -> Report:
        """What ``--report`` writes, as ``docs/report.schema.json`` says.

        ``load_seconds``  what reading the mesh and the occluder took.
        """
        return build_report(
            self.mesh, self.occluder, self.solid, self.accuracy,
            options={
                **asdict(self.resolved.solid),
                "viewers": self.options.viewers,
                "transparent": self.options.transparent,
                "overrides": overrides_summary(self.overrides),
                "accuracy": asdict(self.accuracy.options),
            },
            timings={**self.timings, "load": load_seconds}, warnings=self.warnings,
            seed=self.options.seed,
        )  # fmt: skip

    def write_pictures(
        self, folder: str | Path, name: str, report: Report | None = None
    ) -> list[Path]:
        """Write silhouettes, histograms and an HTML page; what was written.

        ``name`` is what the page calls the mesh, ``report`` what it shows: by default a new one.
        Raises :class:`~simplifier.errors.OutputError`.
        """
        shown = self.report() if report is None else report
        return write_pictures(folder, self.mesh, self.occluder, self.accuracy, shown, name=name)


def judge(
    mesh: TriangleMesh,
    occluder: Occluder,
    options: EvaluateOptions | None = None,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
) -> Judgement:
    """Measure an occluder: precision, recall, and how far it strays from the mesh.

    ``listener``  called with the :class:`~simplifier.progress.Progress` so far; what it raises
                  ends the run.
    ``cancel``    once set, ends the run before its next stage with
                  :class:`~simplifier.errors.CancelledError`.

    ``overrides``  of the mesh, which was loaded with what they ignore; the occluder is to keep
                  their regions open.

    Raises :class:`~simplifier.errors.OccluderError`.
    """
    chosen = EvaluateOptions() if options is None else options
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("occluder", occluder, Occluder, AN_OCCLUDER)
    check_kind("options", chosen, EvaluateOptions, "simplifier.EvaluateOptions")
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    made_by = resolved(chosen, float(mesh.extent.max()))
    held = MeshSize(len(occluder.vertices), len(occluder.faces)).held
    check_options(
        lambda each: (
            need_of_solid(mesh, each)
            .joined(need_of_judging(mesh, each, judging_of(chosen)))
            .beside(held)
        ),
        made_by,
        chosen.memory_limit,
    )
    watch = Stopwatch(listener, cancel)
    solid = solidify(mesh, made_by.solid, watch)
    with watch.stage("accuracy"):
        accuracy = evaluate_accuracy(mesh, occluder, accuracy_options(chosen))
    return Judgement(mesh, occluder, chosen, made_by, solid, accuracy, watch.timings, overrides)
