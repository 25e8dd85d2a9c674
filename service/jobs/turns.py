"""Whose job is done next: turns between tenants, and an order within each.

Tenants take turns, one job a turn; whose last one is longest ago is next.  Of a tenant's own jobs
the interactive ones go before the bulk ones, each in the order in which they came; but after
:data:`IN_A_ROW` interactive jobs in a row a bulk job that waits has the turn, so that none waits
for ever.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

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


class Standing(NamedTuple):
    """When a tenant had its last turn, and its interactive jobs in a row; 0 for a new one."""

    turn: int = 0
    streak: int = 0


class Waiting(NamedTuple):
    """A job that waits."""

    number: int
    tenant: str
    priority: Priority


def chosen(interactive: int | None, bulk: int | None, streak: int) -> tuple[int, int]:
    """Which of a tenant's two first jobs has its turn, by number, and the streak after that.

    At least one of them is there.
    """
    if bulk is not None and (interactive is None or streak >= IN_A_ROW):
        return bulk, 0
    assert interactive is not None
    return interactive, 0 if bulk is None else streak + 1


def in_turn(waiting: Iterable[Waiting], standings: Mapping[str, Standing]) -> list[Waiting]:
    """Jobs in the order in which one worker would begin them, if no more came.

    ``waiting``  by number.
    """
    lines: dict[str, dict[Priority, deque[Waiting]]] = {}
    for job in waiting:
        line = lines.setdefault(job.tenant, {one: deque() for one in Priority})
        line[job.priority].append(job)
    streaks = {tenant: standings.get(tenant, Standing()).streak for tenant in lines}
    next_turn = 1 + max((one.turn for one in standings.values()), default=0)
    heap = [
        (standings.get(tenant, Standing()).turn, _first(line), tenant)
        for tenant, line in lines.items()
    ]
    heapq.heapify(heap)
    order: list[Waiting] = []
    while heap:
        _, _, tenant = heap[0]
        line = lines[tenant]
        interactive, bulk = (line[one][0].number if line[one] else None for one in Priority)
        number, streaks[tenant] = chosen(interactive, bulk, streaks[tenant])
        order.append(line[Priority.BULK if number == bulk else Priority.INTERACTIVE].popleft())
        if any(line.values()):
            heapq.heapreplace(heap, (next_turn, _first(line), tenant))
            next_turn += 1
        else:
            heapq.heappop(heap)
    return order


def _first(line: Mapping[Priority, deque[Waiting]]) -> int:
    return min(one[0].number for one in line.values() if one)
