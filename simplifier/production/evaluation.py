"""What evaluating gives: how good an occluder is, made here or elsewhere, with its report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from simplifier.accuracy.accuracy import AccuracyReport
from simplifier.accuracy.overhang import Overhang
from simplifier.accuracy.verdict import EngineVerdict, verdict_on
from simplifier.device.choice import open_device
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.solid import Solid
from simplifier.geometry.views import ViewShares
from simplifier.options.simplify import EvaluateOptions
from simplifier.options.stages import Options
from simplifier.production.next_try import NAMES, Names, next_evaluate
from simplifier.production.remarks import misplaced, overrides_summary, remarks
from simplifier.report.page import write_pictures
from simplifier.report.report import Report, build_report, verdict_figures


@dataclass(frozen=True, eq=False)
class EvaluateResult:
    """How good an occluder is.

    ``front``     the shares of the mesh's pixels that the occluder stands before.
    ``stages``    what counts as the mesh's inside, in the solid.
    ``timings``   seconds by stage.
    """

    mesh: TriangleMesh
    occluder: Occluder
    options: EvaluateOptions
    stages: Options
    solid: Solid
    accuracy: AccuracyReport
    overhang: Overhang
    front: ViewShares
    timings: Mapping[str, float]
    overrides: Overrides = NO_OVERRIDES

    def __repr__(self) -> str:
        return f"<EvaluateResult: {self.verdict}>"

    @property
    def precision(self) -> float:
        """Share of what the occluder hides that the mesh hides too, over all views."""
        return self.accuracy.precision

    @property
    def recall(self) -> float:
        """Share of what the mesh hides that the occluder hides too, over all views."""
        return self.accuracy.recall

    @property
    def verdict(self) -> EngineVerdict:
        """Whether it is good for an engine, and why."""
        return verdict_on(verdict_figures(self.occluder, self.accuracy, self.overhang))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know beside the verdict, a sentence each."""
        kept = Overrides(open=self.overrides.open)  # what is drawn is the occluder's own affair
        return (
            *misplaced(self.mesh, self.occluder),
            *remarks(self.mesh, self.occluder, self.solid, kept),
            *open_device(self.options.device).remarks,
        )

    def report(self, *, load_seconds: float = 0.0, names: Names = NAMES) -> Report:
        """What ``--report`` writes, as ``docs/report.schema.json`` says.

        ``load_seconds``  what reading the mesh and the occluder took.
        ``names``  of mesh and occluder in the command to try next.
        """
        verdict = self.verdict
        return build_report(
            self.mesh, self.occluder, self.solid, self.accuracy,
            options={
                **asdict(self.stages.solid),
                "transparent": self.options.transparent,
                "overrides": overrides_summary(self.overrides),
                "accuracy": asdict(self.accuracy.options),
            },
            timings={**self.timings, "load": load_seconds}, warnings=self.warnings,
            seed=self.options.seed, overhang=self.overhang, front=self.front, verdict=verdict,
            command=next_evaluate(self.options, verdict, names),
            device=open_device(self.options.device),
        )  # fmt: skip

    def write_pictures(
        self, folder: str | Path, name: str, report: Report | None = None
    ) -> list[Path]:
        """Write silhouettes, histograms and an HTML page; what was written.

        ``name`` is what the page calls the mesh, ``report`` what it shows: by default a new one.
        Raises :class:`~simplifier.errors.OutputError`.
        """
        shown = self.report() if report is None else report
        return write_pictures(
            folder, self.mesh, self.occluder, self.accuracy, shown, name=name,
            device=open_device(self.options.device),
        )  # fmt: skip
