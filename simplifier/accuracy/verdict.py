"""A result in a word, for those who put it into an engine: good, weak or unusable, and why.

The limits stand here and nowhere else.  They are drawn where results part: what the meshes of
``docs/accuracy.md`` give by default is good, and what an artist would send back is not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

from simplifier.wording import exact_percent, percent, percent_at_most, small_percent

VerdictWord = Literal["good", "weak", "unusable"]

VERDICT_WORDS: tuple[VerdictWord, ...] = get_args(VerdictWord)
"""From the best to the worst."""

LEAST_RECALL = 0.10
"""Below it an engine draws the occluder for next to nothing: nine of ten objects behind the mesh
are drawn all the same."""

GOOD_RECALL = 0.40
"""Of the statues and machines of Table 1 of the paper the worst printed has 47.8 %; machines of
thin parts, the hardest that are made by default, have 44 %."""

LEAST_PRECISION = 0.95
"""Below it one in twenty things that vanish can be seen, which no viewer overlooks."""

GOOD_PRECISION = 0.99
"""What the sweeps of ``occluder tradeoff`` ask of a setting; the paper prints 99.8 % and more."""

MOST_OVERHANG = 0.05
"""Beyond it holes open beside the mesh, five pixels wide along one that is 500 pixels high."""

GOOD_OVERHANG = 0.03
"""The paper's own method has 1 to 2 % on statues; two or three pixels along such a mesh."""

LEAST_COVERAGE = 0.0001
"""Below it a sample of quads meets so few that recall differs by points from seed to seed, so all
quads are counted instead.  Statues and buildings have 1 to 40 %, levels and city blocks 0.3 %,
machines of thin parts 0.04 %, a bare tree 0.0003 %."""

NEARLY = 1.1
"""Times an aim that still keeps it: the search judges by other views, which differ by as much."""

Figure = Literal["recall", "precision", "overhang", "coverage"]


@dataclass(frozen=True)
class VerdictFigures:
    """What a verdict is made of, as shares; ``overhang`` is the mean over all views.

    ``coverage``  as :mod:`simplifier.accuracy.accuracy` says.
    """

    triangles: int
    precision: float
    recall: float
    overhang: float
    coverage: float


@dataclass(frozen=True)
class Aim:
    """A figure that was aimed for; ``chosen`` if the user set it, so that missing it counts."""

    share: float
    chosen: bool


@dataclass(frozen=True)
class Aims:
    """What making it aimed for; None where there was no aim, as for an occluder from elsewhere.

    ``distance``  how many times as far as the finest a level is looked at from: a pixel beside its
                  outline is as much more of the mesh.  ``overhang`` is the level's own.
    """

    precision: Aim | None = None
    overhang: Aim | None = None
    distance: float = 1.0


@dataclass(frozen=True)
class Fault:
    """What is wrong with a figure, in words, and the best verdict that it allows."""

    figure: Figure
    word: VerdictWord
    what: str


@dataclass(frozen=True)
class EngineVerdict:
    """A word with its reason.

    ``faults``  the reason's, the worst first; none of a good one.
    ``remarks``  aims of the defaults that were missed, which change nothing about the word.
    """

    word: VerdictWord
    reason: str
    faults: tuple[Fault, ...] = ()
    remarks: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.word}: {self.reason}"

    @property
    def is_good(self) -> bool:
        """Whether there is nothing to do about it."""
        return self.word == "good"


def verdict_on(figures: VerdictFigures, aims: Aims | None = None) -> EngineVerdict:
    """The worst of what each figure allows; the same figures and aims give the same words."""
    found = list(_faults(figures, aims or Aims()))
    counted = sorted((one for one in found if one.word != "good"), key=lambda one: -_rank(one.word))
    remarks = tuple(one.what for one in found if one.word == "good")
    if counted:
        reason = "; ".join(one.what for one in counted)
        return EngineVerdict(counted[0].word, reason, tuple(counted), remarks)
    hidden, rightly = percent(figures.recall, 2), percent(figures.precision, 2)
    reason = (
        f"it hides {hidden} of what the mesh hides, with a precision of {rightly}, and covers"
        f" {percent_at_most(figures.overhang)} beside it"
    )
    return EngineVerdict("good", reason, (), remarks)


def falls_short(word: VerdictWord, least: VerdictWord) -> bool:
    """Whether a verdict is worse than another."""
    return _rank(word) > _rank(least)


def _rank(word: VerdictWord) -> int:
    return VERDICT_WORDS.index(word)


def _faults(figures: VerdictFigures, aims: Aims) -> Iterator[Fault]:
    if figures.coverage == 0.0:
        yield Fault(
            "coverage", "unusable",
            "the mesh is so thin that no view shows a pixel of it, so precision and recall say"
            " nothing; raise the image",
        )  # fmt: skip
        return
    if figures.triangles == 0:
        yield Fault("recall", "unusable", "it has no triangles, so it hides nothing")
    else:
        yield from _of_recall(figures.recall)
        yield from _of_precision(figures.precision, aims.precision)
        yield from _of_overhang(figures.overhang, aims)
    if figures.coverage < LEAST_COVERAGE:
        yield Fault(
            "coverage", "weak",
            f"the mesh fills {small_percent(figures.coverage)} of what is looked at, so recall"
            " means little",
        )  # fmt: skip


def _of_recall(recall: float) -> Iterator[Fault]:
    what = f"it hides {percent(recall, 2)} of what the mesh hides"
    if recall < LEAST_RECALL:
        limit = f"(below {exact_percent(LEAST_RECALL)} it is not worth drawing)"
        yield Fault("recall", "unusable", f"{what} {limit}")
    elif recall < GOOD_RECALL:
        limit = f"(a good occluder hides at least {exact_percent(GOOD_RECALL)})"
        yield Fault("recall", "weak", f"{what} {limit}")


def _of_precision(precision: float, aim: Aim | None) -> Iterator[Fault]:
    what = f"precision is {percent(precision, 2)}"
    if precision < LEAST_PRECISION:
        limit = f"(below {exact_percent(LEAST_PRECISION)} visible objects vanish)"
        yield Fault("precision", "unusable", f"{what} {limit}")
    elif precision < GOOD_PRECISION:
        limit = f"(a good occluder has at least {exact_percent(GOOD_PRECISION)})"
        yield Fault("precision", "weak", f"{what} {limit}")
    elif aim is not None and 1.0 - precision > NEARLY * (1.0 - aim.share):
        missed = f"{what}, below the target of {exact_percent(aim.share)}"
        yield Fault("precision", _missed(aim), missed)


def _of_overhang(overhang: float, aims: Aims) -> Iterator[Fault]:
    what = f"the occluder covers {percent_at_most(overhang)} beside the mesh"
    # Who asks for much gets it: that is no fault.
    aim = aims.overhang
    asked = NEARLY * aim.share if aim is not None and aim.chosen else 0.0
    most = max(MOST_OVERHANG * aims.distance, asked)
    good = max(GOOD_OVERHANG * aims.distance, asked)
    if overhang > most:
        limit = f"(above {exact_percent(most)} visible objects vanish)"
        yield Fault("overhang", "unusable", f"{what} {limit}")
    elif overhang > good:
        limit = f"(a good occluder covers at most {exact_percent(good)})"
        yield Fault("overhang", "weak", f"{what} {limit}")
    elif aim is not None and overhang > NEARLY * aim.share:
        missed = f"{what}, above the limit of {exact_percent(aim.share)}"
        yield Fault("overhang", _missed(aim), missed)


def _missed(aim: Aim) -> VerdictWord:
    return "weak" if aim.chosen else "good"
