"""``occluder simplify`` as one call: a mesh to its occluder or levels, judged and reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from simplifier.accuracy.accuracy import AccuracyReport, evaluate_accuracies
from simplifier.accuracy.deviation import deviation
from simplifier.checks import check_kind
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.io import save_occluder
from simplifier.io.glb_embed import save_with_original
from simplifier.io.save import save_lods
from simplifier.io.style import PLAIN, Embedding, Style
from simplifier.lods.level_plan import plan_levels
from simplifier.lods.levels import Levels, simplify_levels
from simplifier.memory.runs import check_making
from simplifier.options import Options
from simplifier.pipeline import Simplification, simplify_mesh
from simplifier.production.measures import accuracy_options, judging_of
from simplifier.production.options import SimplifyOptions
from simplifier.production.remarks import overrides_summary, remarks
from simplifier.production.resolve import resolved
from simplifier.progress import Cancel, Listener, Stopwatch
from simplifier.report.page import write_pictures
from simplifier.report.report import Report, build_report, left_out_rows, level_rows

_UNSEEN = (
    "the mesh is so thin that no view shows a pixel of it, so precision and recall say nothing; "
    "raise the image"
)


@dataclass(frozen=True, eq=False)
class Made:
    """What was made of a mesh, not judged yet: it can be saved before that takes its time.

    ``resolved``  the options of the occluder, or of the finest level.
    """

    mesh: TriangleMesh
    options: SimplifyOptions
    resolved: Options
    result: Simplification | Levels
    overrides: Overrides = NO_OVERRIDES

    @property
    def occluder(self) -> Occluder:
        """The occluder, or the finest level's."""
        return self.result.occluder

    @property
    def interrupted(self) -> bool:
        """Whether the run was cancelled, so that this is the best so far."""
        return self.result.interrupted

    def save(self, path: str | Path, style: Style = PLAIN) -> tuple[Path, ...]:
        """Write in the format of the suffix, all or nothing; the files, finest level first.

        Raises :class:`~simplifier.errors.OutputError`.
        """
        if isinstance(self.result, Levels):
            return save_lods(self.result.chain, path, style)
        save_occluder(self.result.occluder, path, style)
        return (Path(path),)

    def save_with_original(
        self, original: Path, path: Path, how: Embedding, style: Style = PLAIN
    ) -> tuple[Path, ...]:
        """Write a GLB of the file that the mesh was read from, the occluder (the finest) in it.

        Raises :class:`~simplifier.errors.OutputError` and
        :class:`~simplifier.errors.UnreadableMeshError`.
        """
        save_with_original(original, self.mesh, self.occluder, path, how, style)
        return (path,)

    def judged(self, listener: Listener | None = None) -> Product:
        """Measure precision and recall, of every level."""
        watch = Stopwatch(listener)
        with watch.stage("accuracy"):
            chain = self._chain()
            accuracies = evaluate_accuracies(
                self.mesh,
                [level.occluder for level in chain.levels],
                accuracy_options(self.options),
            )
            notes = remarks(self.mesh, self.occluder, self.result.solid, self.overrides)
        return Product(self, chain, accuracies, watch.timings["accuracy"], notes)

    def _chain(self) -> LodChain:
        if isinstance(self.result, Levels):
            return self.result.chain
        solid = self.result.solid
        strays = deviation(self.occluder, self.mesh, solid.touched, solid.filled)
        return LodChain((Level(self.occluder, self.resolved.solid.resolution, strays),), Lens())


@dataclass(frozen=True, eq=False)
class Product:
    """An occluder or levels of detail, judged.

    ``chain``       the levels, finest first; a single occluder is a chain of one.
    ``accuracies``  one a level, in the same order.
    ``judging``     seconds that they took.
    ``remarks``     on overrides and what was left out, a sentence each.
    """

    made: Made
    chain: LodChain
    accuracies: tuple[AccuracyReport, ...]
    judging: float
    remarks: tuple[str, ...] = ()

    @property
    def mesh(self) -> TriangleMesh:
        """What it was made of."""
        return self.made.mesh

    @property
    def levels(self) -> tuple[Level, ...]:
        """At least one, finest first."""
        return self.chain.levels

    @property
    def occluder(self) -> Occluder:
        """The finest level's."""
        return self.made.occluder

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know, a sentence each."""
        unseen = (_UNSEEN,) if self.accuracies[0].shows_nothing else ()
        return (*self.made.result.warnings, *unseen, *self.remarks)

    @property
    def interrupted(self) -> bool:
        """Whether the run was cancelled, so that this is the best so far."""
        return self.made.interrupted

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds by stage; levels were judged as they were made, too."""
        timings = dict(self.made.result.timings)
        timings["accuracy"] = timings.get("accuracy", 0.0) + self.judging
        return timings

    def save(self, path: str | Path, style: Style = PLAIN) -> tuple[Path, ...]:
        """As :meth:`Made.save`."""
        return self.made.save(path, style)

    def report(
        self,
        *,
        load_seconds: float = 0.0,
        write_seconds: float = 0.0,
        files: Sequence[Path] | None = None,
    ) -> Report:
        """What ``--report`` writes, as ``docs/report.schema.json`` says.

        ``load_seconds``, ``write_seconds``  what reading the mesh and :meth:`save` took.
        ``files``  what :meth:`save` returned; None where nothing was saved.
        """
        made, result = self.made, self.made.result
        asked = isinstance(result, Levels)
        return build_report(
            self.mesh, self.occluder, result.solid, self.accuracies[0],
            options=_resolved(made),
            timings={**self.timings, "load": load_seconds, "write": write_seconds},
            warnings=self.warnings, seed=made.options.seed, strays=self.levels[0].deviation,
            levels=level_rows(self.chain, self.accuracies, files) if asked else (),
            left_out=left_out_rows(self.chain),
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
            folder, self.mesh, self.occluder, self.accuracies[0], shown, name=name
        )


def produce(
    mesh: TriangleMesh,
    options: SimplifyOptions | None = None,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
) -> Product:
    """Make an occluder, or levels of detail where the options ask for them, and judge it.

    ``listener``  called with the :class:`~simplifier.progress.Progress` so far; what it raises
                  ends the run.
    ``cancel``    once set, ends the making soon: with the best so far when refining of the finest
                  level has begun, which is judged all the same, else with
                  :class:`~simplifier.errors.CancelledError`.

    ``overrides``  what was decided by hand; the mesh was loaded with what they ignore.

    Same mesh, same options, same bytes, as for :func:`simplifier.simplify`.  Raises
    :class:`~simplifier.errors.OccluderError`.
    """
    chosen = SimplifyOptions() if options is None else options
    return make(mesh, chosen, listener, cancel, overrides).judged(listener)


def make(
    mesh: TriangleMesh,
    options: SimplifyOptions,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
) -> Made:
    """The first half of :func:`produce`, for those who save before they judge.

    Raises :class:`~simplifier.errors.MemoryLimitError` where either half would need more memory
    than ``options.memory_limit``.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("options", options, SimplifyOptions, "simplifier.SimplifyOptions")
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    longest, levels = float(mesh.extent.max()), options.levels
    chosen = resolved(options, longest)
    check_making(mesh, chosen, options.memory_limit, judging_of(options))
    result: Simplification | Levels
    if levels is None:
        result = simplify_mesh(mesh, chosen, listener, cancel, overrides)
    else:
        plan = plan_levels(longest, chosen, levels, len(overrides.triangles))
        result = simplify_levels(mesh, plan, listener, cancel, overrides)
    return Made(mesh, options, chosen, result, overrides)


def _resolved(made: Made) -> dict[str, Any]:
    """Every option that had a part in the result, by the name that users type."""
    chosen, options = made.options, made.resolved
    return {
        **asdict(options.solid),
        "viewers": options.viewers,
        "transparent": chosen.transparent,
        "overrides": overrides_summary(made.overrides),
        **asdict(options.sections),
        **asdict(options.selection),
        "refine": asdict(options.refine),
        "time_limit": options.time_limit,
        "lods": None if chosen.levels is None else asdict(chosen.levels),
        "accuracy": asdict(accuracy_options(chosen)),
    }
