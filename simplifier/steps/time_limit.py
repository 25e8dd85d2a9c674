"""What a time limit leaves room for, judged by what a quick start took."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import Solid
from simplifier.options.stages import Options, SectionOptions
from simplifier.progress import Deadline, Stopwatch, TimeUpError
from simplifier.slicing.planes import plan_sections

QUICK = SectionOptions(directions=4, depths=3, depth_samples=8)
"""Sections that nearly any limit leaves time for."""

FEW_VIEWS = 16
"""Pictures below which refining hides what no view shows."""

_START_SHARE = 0.25  # of the time left, that a fuller start may take
_VIEWS_SHARE = 0.25  # of the time left, that drawing the original may take
_EXCHANGE = 0.05  # what an exchange costs, as a share of the choice before it


@dataclass(frozen=True)
class StartCost:
    """What a start goes through: planes to cut, bins of a section each, and exchanges."""

    planes: int
    bins: int
    exchanges: int


Start = Callable[[Options, Stopwatch], FloatArray]
"""Makes triangles from a solid with these options, which refining begins from."""


def start_in_time(
    start: Start,
    solid: Solid,
    flats: FloatArray,
    options: Options,
    watch: Stopwatch,
    deadline: Deadline,
) -> FloatArray:
    """What ``start`` makes; under a time limit a quick one, which is always ended, and then as full
    a one as a quarter of the time that is left allows, if that fits.  It cuts along ``flats`` too.
    """
    if not deadline.limited:
        return start(options, watch)
    small, before = quick(options), Counter(watch.timings)
    found = start(small, watch)
    took = {stage: seconds - before[stage] for stage, seconds in watch.timings.items()}
    fuller = _fullest_affordable(solid, flats, options, small, took, deadline)
    if fuller is not None:
        with suppress(TimeUpError):
            found = start(fuller, watch.until(deadline.part(0.5)))
    return found


def _fullest_affordable(
    solid: Solid,
    flats: FloatArray,
    options: Options,
    small: Options,
    took: Mapping[str, float],
    deadline: Deadline,
) -> Options | None:
    """The most directions that time is left for, judged by what a small start took."""
    done = _cost_of(solid, flats, small)
    slicing = took["sections"]
    choosing = took["loops"] + took["chains"] + took["cut"]
    for fuller in fewer_directions(options):
        if leaves_time_for(done, slicing, choosing, _cost_of(solid, flats, fuller), deadline.left):
            return fuller
    return None


def _cost_of(solid: Solid, flats: FloatArray, options: Options) -> StartCost:
    plan = plan_sections(solid.core, options.sections, flats)
    return StartCost(len(plan), plan.bins, options.selection.exchanges)


def quick(options: Options) -> Options:
    """The same with the least work before refining."""
    return replace(
        options,
        sections=replace(QUICK, slicer=options.sections.slicer),
        selection=replace(options.selection, exchanges=0),
    )


def fewer_directions(options: Options) -> list[Options]:
    """The same with all directions, half of them, and so on; more than those of a quick start."""
    count = options.sections.directions
    made = []
    while count > QUICK.directions:
        made.append(replace(options, sections=replace(options.sections, directions=count)))
        count //= 2
    return made


def leaves_time_for(
    done: StartCost, slicing: float, choosing: float, more: StartCost, left: float
) -> bool:
    """Whether ``more`` work fits into the time that is left and leaves most of it to refining.

    ``slicing`` and ``choosing`` are the seconds that the ``done`` work took, by planes and by bins.
    """
    cost = slicing * more.planes / done.planes
    cost += choosing * more.bins / done.bins * (1.0 + _EXCHANGE * more.exchanges)
    return cost <= _START_SHARE * left


def affordable_views(most: int, drawn: int, took: float, left: float) -> int:
    """Views to refine by, when drawing some took so many seconds; no fewer than were drawn.

    Those that are drawn are lost when there are to be more, so twice as many is the least gain.
    """
    views = min(most, int(_VIEWS_SHARE * left * drawn / max(took, 1e-9)))
    return views if views >= 2 * drawn else drawn
