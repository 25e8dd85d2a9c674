"""Whose job is done next: turns between tenants, and an order within each.

Tenants take turns, one job a turn; whose last one is longest ago is next.  Of a tenant's own jobs
the interactive ones go before the bulk ones, each in the order in which they came; but after
:data:`IN_A_ROW` interactive jobs in a row a bulk job that waits has the turn, so that none waits
for ever.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from service.jobs.job import Priority

IN_A_ROW = 3
"""Interactive jobs of a tenant that are begun while a bulk job of it waits; then that one is."""


@dataclass(frozen=True)
class Shares:
    """What one tenant may have of the queue and of the workers; None leaves it to a rule.

    ``workers``  jobs that are done at a time.
    ``waiting``  jobs of a tenant that may wait; by default all that may wait, and half of them
                 where another tenant has a key.
    ``running``  jobs of a tenant that are done at a time; by default no limit, and one worker is
                 left to the others where another tenant has a key and there are several workers.
    """

    workers: int = 1
    waiting: int | None = None
    running: int | None = None

    def most_waiting(self, queue_limit: int, *, others: bool) -> int:
        """``others``: whether another tenant has a key."""
        if self.waiting is not None:
            return min(self.waiting, queue_limit)
        return max(1, queue_limit // 2) if others else queue_limit

    @property
    def most_running(self) -> int:
        """Of a tenant beside others."""
        return max(1, self.workers - 1) if self.running is None else self.running


@dataclass(frozen=True)
class Line:
    """How a tenant's line stands.

    ``turn``     when it had its last one; 0 for a new tenant.
    ``first``    the number of its first job that waits.
    ``waiting``  jobs that wait.
    ``streak``   interactive jobs that it had in a row while a bulk job of its own waited.
    """

    tenant: str
    turn: int
    first: int
    waiting: int
    streak: int = 0

    def is_before(self, other: Line) -> bool:
        """Whether its next turn comes before that of another."""
        return (self.turn, self.first) < (other.turn, other.first)


def chosen(interactive: int | None, bulk: int | None, streak: int) -> tuple[int, int]:
    """Which of a tenant's two first jobs has its turn, by number, and the streak after that.

    At least one of them is there.
    """
    if bulk is not None and (interactive is None or streak >= IN_A_ROW):
        return bulk, 0
    assert interactive is not None
    return interactive, 0 if bulk is None else streak + 1


def in_order(interactive: Sequence[int], bulk: Sequence[int], streak: int) -> Iterator[int]:
    """The jobs of one tenant in the order of their turns; each of the two by number."""
    first, second = deque(interactive), deque(bulk)
    while first or second:
        number, streak = chosen(first[0] if first else None, second[0] if second else None, streak)
        (second if second and number == second[0] else first).popleft()
        yield number


def jobs_before(priority: Priority, same: int, other: int, streak: int) -> int:
    """How many jobs of its own tenant are begun before a job, as :func:`in_order` has them.

    ``same``   of its priority that came before it; ``other`` of the other priority that wait.
    """
    if priority is Priority.INTERACTIVE:
        return same + min(other, (streak + same) // IN_A_ROW)
    return same + min(other, max(0, IN_A_ROW * (same + 1) - streak))


def place(before: int, mine: Line, others: Iterable[Line]) -> int:
    """The place of a job in the queue, from 1, if no more came.

    ``before``  jobs of its own tenant that are begun before it.

    Turns go round: each tenant that waits has had as many before it as its own has, and those
    whose turn comes first have had one more.
    """
    return 1 + before + sum(min(one.waiting, before + one.is_before(mine)) for one in others)
