"""The occluder against what it was made with: sections, views, pixels, voxels.

Each value is tried with five seeds of the search, all else as by default, and all occluders of a
mesh are judged together: the same 1024 random views that no search has seen, 256 pixels, all quads
counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from bench.record import Row
from bench.stability.convergence.pictures import made_by_pictures
from bench.stability.convergence.spread import Spread, below_half_a_point
from bench.stability.convergence.subjects import Subject
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracies
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.kernels.bit_image import SIZE
from simplifier.options.stages import Options, make_options
from simplifier.pipeline import simplify_mesh

FIGURES = ("recall", "precision")
SEEDS = 5
JUDGE = AccuracyOptions(views=1024, seed=20_250_101, exact=True)

Make = Callable[[TriangleMesh, Options, int], Occluder]


@dataclass(frozen=True)
class Knob:
    """One thing to make occluders with.

    ``default``  of the preset that is the default.
    ``values``   ascending, the default among them.
    ``make``     an occluder from a mesh, options and a value of the knob.
    """

    name: str
    default: int
    values: tuple[int, ...]
    make: Make


@dataclass(frozen=True)
class Trial:
    """Recall and precision over the seeds, percent, at one value; ``by_seed`` in their order."""

    mesh: str
    knob: Knob
    value: int
    by_seed: Mapping[str, tuple[float, ...]]

    def spread(self, figure: str) -> Spread:
        return Spread.of(self.by_seed[figure])

    @property
    def row(self) -> Row:
        row: dict[str, object] = {
            "mesh": self.mesh, "knob": self.knob.name, "value": self.value, "seeds": SEEDS,
        }  # fmt: skip
        for figure in FIGURES:
            spread = self.spread(figure)
            row |= {figure: spread.mean, f"{figure}_deviation": spread.deviation}
        return row


def _by_options(change: Callable[[Options, int], Options]) -> Make:
    return lambda mesh, options, value: simplify_mesh(mesh, change(options, value)).occluder


def _directions(options: Options, value: int) -> Options:
    return replace(options, sections=replace(options.sections, directions=value))


def _cut_views(options: Options, value: int) -> Options:
    return replace(options, selection=replace(options.selection, views=value))


def _refine_views(options: Options, value: int) -> Options:
    return replace(options, refine=replace(options.refine, views=value))


def _resolution(options: Options, value: int) -> Options:
    return replace(options, solid=replace(options.solid, resolution=value))


_USUAL = make_options(1.0)

KNOBS = (
    Knob("section directions", _USUAL.sections.directions, (8, 32, 128), _by_options(_directions)),
    Knob("views of the cut", _USUAL.selection.views, (12, 48, 192), _by_options(_cut_views)),
    Knob(
        "views of refining", _USUAL.refine.views, (36, 72, 144, 288, 576),
        _by_options(_refine_views),
    ),
    Knob("pixels of refining", SIZE, (16, 32, 64), made_by_pictures),
    Knob("resolution", _USUAL.solid.resolution, (32, 64, 128), _by_options(_resolution)),
)  # fmt: skip

DEFAULT_VALUES = {knob.name: knob.default for knob in KNOBS}


def trials(subject: Subject, knobs: tuple[Knob, ...] = KNOBS) -> Iterator[Trial]:
    """Every value of every knob; the default is made once and stands in each of them."""
    asked = [
        make_options(float(subject.mesh.extent.max()), seed=seed, **subject.options)
        for seed in range(SEEDS)
    ]
    usual = [simplify_mesh(subject.mesh, options).occluder for options in asked]
    made = {("", 0): usual}
    for knob in knobs:
        for value in knob.values:
            if value != knob.default:
                made[knob.name, value] = [
                    knob.make(subject.mesh, options, value) for options in asked
                ]
    figures = dict(zip(made, _judged(subject.mesh, list(made.values())), strict=True))
    for knob in knobs:
        for value in knob.values:
            key = ("", 0) if value == knob.default else (knob.name, value)
            yield Trial(subject.name, knob, value, figures[key])


def _judged(
    mesh: TriangleMesh, groups: list[list[Occluder]]
) -> Iterator[dict[str, tuple[float, ...]]]:
    """Percent, by figure, of each group of seeds."""
    reports = iter(evaluate_accuracies(mesh, [one for group in groups for one in group], JUDGE))
    for group in groups:
        mine = [next(reports) for _ in group]
        yield {
            figure: tuple(100.0 * float(getattr(report, figure)) for report in mine)
            for figure in FIGURES
        }


def verdicts(found: list[Trial]) -> Iterator[Row]:
    """What the most of each knob brings over its default, and whether that is below half a point.

    Runs of one seed are pairs: the seed is the same in both.
    """
    by_place = {(trial.mesh, trial.knob.name, trial.value): trial for trial in found}
    for trial in found:
        if trial.value != trial.knob.default:
            continue
        rest = [value for value in trial.knob.values if value != trial.knob.default]
        most = by_place[trial.mesh, trial.knob.name, rest[-1]]
        row: dict[str, object] = {
            "mesh": trial.mesh, "knob": trial.knob.name, "default": trial.value,
            "compared with": most.value,
        }  # fmt: skip
        for figure in FIGURES:
            pairs = zip(most.by_seed[figure], trial.by_seed[figure], strict=True)
            gain = Spread.of([more - usual for more, usual in pairs])
            row |= {
                f"{figure} gain": f"{gain.mean:+.2f} ± {gain.standard_error:.2f}",
                f"{figure} good": below_half_a_point(gain),
            }
        yield row
