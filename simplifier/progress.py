"""What a run tells its caller while it works, and how the caller ends it.

A time limit: how much of it is spent, and when it is up.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from copy import copy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from simplifier.checks import check_callable, check_cancel
from simplifier.errors import CancelledError

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray


STAGES = (
    "load", "voxelize", "fill", "surface", "sections", "loops", "chains", "cut", "refine",
    "write", "accuracy",
)  # fmt: skip
"""Every stage that a report has a time for, in the order in which they run."""


Best = Callable[[], "NDArray[float64]"]
"""Gives the triangles (n, 3, 3) of the best occluder so far, world units: a copy.

They keep the error bound; some may be of no use.  Cheap, and to be called within the listener only.
"""


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    ``stage``    one of :data:`STAGES`; with a time limit some run twice, small and then in full.
    ``share``    of the stage that is done, 0 at its start and 1 at its end.
    ``seconds``  since the run began.
    ``measure``  the share of the original's occlusion measure that the occluder has by now, in the
                 search's pictures and less what it covers wrongly; None before refining.
    ``level``    of detail that is made, from 0, the finest; of ``levels``.
    ``best``     the triangles that have that measure, as :data:`Best`; None where there is none.
    """

    stage: str
    share: float
    seconds: float
    measure: float | None = None
    level: int = 0
    levels: int = 1
    best: Best | None = field(default=None, compare=False, repr=False)


Listener = Callable[[Progress], None]
"""Called between steps and from the caller's thread only; what it raises ends the run."""


TellShare = Callable[[float], None]
"""Called now and then with the share of the work that is done; what it raises ends the work."""

TellCount = Callable[[int, int], None]
"""Called with how many pieces of the work are done, and how many there are."""

TellStep = Callable[[int, str], object]
"""Called with how many pieces of the work are done, and the name of the one that runs now."""

TellTotalStep = Callable[[int, int, str], object]
"""Called with how many pieces are done, how many there are, and the name of the one that runs."""


def silent(share: float) -> None:
    """The :data:`TellShare` that tells nobody."""


ShowCount = Callable[[], AbstractContextManager[TellCount]]
"""Shows a count while the block runs."""

_shows_compiling: list[ShowCount] = []


def show_compiling_by(show: ShowCount) -> None:
    """From now on, whenever kernels have to be compiled first, show by that how far it is.

    It comes at the first call of a kernel, wherever that is, so it is no option of any function.
    """
    _shows_compiling[:] = [show]


@contextmanager
def shown_compiling() -> Iterator[TellCount]:
    """Tell here how many kernel files are compiled, and of how many."""
    with ExitStack() as stack:
        shown = [stack.enter_context(show()) for show in _shows_compiling]

        def tell(done: int, total: int) -> None:
            for one in shown:
                one(done, total)

        yield tell


class Cancel(Protocol):
    """Whether to end the run: a :class:`threading.Event`, or whatever else has this method."""

    def is_set(self) -> bool:
        """Looked at often, from the caller's thread; once true it has to stay so."""


def check_run(listener: Listener | None, cancel: Cancel | None) -> None:
    """Raise :class:`~simplifier.errors.OptionError` for what cannot be called or asked."""
    if listener is not None:
        check_callable("listener", listener)
    check_cancel(cancel)


class TimeUpError(Exception):
    """The deadline of a :meth:`Stopwatch.until` has come; who set it has something to show."""


class Stopwatch:
    """Times stages, tells a listener about them, and looks whether the run is to end."""

    def __init__(self, listener: Listener | None = None, cancel: Cancel | None = None) -> None:
        check_run(listener, cancel)
        self._listener, self._cancel = listener, cancel
        self._begin = time.perf_counter()
        self._deadline: Deadline | None = None
        self.timings: dict[str, float] = {}

    @property
    def cancelled(self) -> bool:
        """Whether the caller asked to end the run."""
        return self._cancel is not None and self._cancel.is_set()

    @property
    def is_alone(self) -> bool:
        """Whether nobody hears of the run, nor can end it."""
        return self._listener is None and self._cancel is None and self._deadline is None

    @contextmanager
    def stage(self, name: str, *, cancels: bool = True) -> Iterator[None]:
        """Time the block as part of the stage; a stage may run more than once.

        It is not begun when the run is cancelled, unless ``cancels`` is false.
        """
        if cancels:
            self.check()
        self.tell(name, 0.0)
        with self.timed(name):
            yield
        self.tell(name, 1.0)

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Time the block as part of the stage, of which nothing is told: a step that is short."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - begin

    def tell(
        self, name: str, share: float, measure: float | None = None, best: Best | None = None
    ) -> None:
        """Report progress within a stage."""
        if self._listener is not None:
            seconds = time.perf_counter() - self._begin
            self._listener(Progress(name, share, seconds, measure, best=best))

    def until(self, deadline: Deadline) -> Stopwatch:
        """The same watch, but steps raise :class:`TimeUpError` once the deadline has come."""
        limited = copy(self)
        limited._deadline = deadline
        return limited

    def check(self) -> None:
        """Raise :class:`~simplifier.errors.CancelledError` when the caller asked to end."""
        if self.cancelled:
            raise CancelledError("cancelled before there was a result")

    def steps(self, name: str) -> TellShare:
        """What a stage tells its share to: it reports each growth, and raises as ``check``."""
        if self.is_alone:  # so that no thread has to watch another one work
            return silent
        told = 0.0

        def tell(share: float) -> None:
            nonlocal told
            if self._deadline is not None and self._deadline.is_up:
                raise TimeUpError
            self.check()
            if told < share < 1.0:  # the stage itself tells its begin and its end
                told = share
                self.tell(name, share)

        return tell


Clock = Callable[[], float]
"""Seconds since some fixed moment; never goes back."""


@dataclass(frozen=True)
class Deadline:
    """A span of time, from ``begin`` on the clock for ``seconds``; infinite for no limit.

    Looking at one costs a call of the clock, well below a microsecond.
    """

    begin: float
    seconds: float
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float | None, clock: Clock = time.perf_counter) -> Deadline:
        """So many seconds from now; None for no limit."""
        return cls(clock(), math.inf if seconds is None else seconds, clock)

    @property
    def limited(self) -> bool:
        """Whether it ever comes."""
        return self.seconds < math.inf

    @property
    def left(self) -> float:
        """Seconds until it, 0 when they are spent."""
        return max(self.begin + self.seconds - self.clock(), 0.0)

    @property
    def share(self) -> float:
        """The share that is spent, 0 to 1; 0 for good without a limit."""
        if self.seconds <= 0.0:
            return 1.0
        return min((self.clock() - self.begin) / self.seconds, 1.0)

    @property
    def is_up(self) -> bool:
        """Whether it has come."""
        return self.left == 0.0

    def rest(self) -> Deadline:
        """The same moment, its share counted from now."""
        return self.part(1.0)

    def part(self, share: float) -> Deadline:
        """That share of what is left, from now."""
        return Deadline.after(share * self.left, self.clock)
