"""A night of jobs on a farm, event by event, from measured figures; for ``bench.scale``.

Processors claim a job, do it, and end it.  A claim and an end each hold the lines of the database
for half of what was measured for both, one after the other.  Nodes are lost one after the other,
each with all that it does, and are back after a while; what they did is begun again.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

_HOUR = 3600.0


@dataclass(frozen=True)
class Farm:
    """``job_seconds``   of a processor, by kind of mesh; each is as likely.
    ``overhead``      seconds a job beside that for which its processor is taken.
    ``database``      seconds for which a claim and its end keep others waiting.
    ``node``          processors that are lost at once, ``lost_every`` so many seconds, ``away`` for
                      so many.
    """

    job_seconds: Sequence[float]
    overhead: float
    database: float
    node: int = 16
    lost_every: float = _HOUR
    away: float = 300.0


@dataclass(frozen=True)
class Night:
    """``hours`` until the last job ended; ``repeated`` attempts that were lost with their node;
    ``database_busy`` share of the time."""

    hours: float
    repeated: int
    database_busy: float


def simulate(farm: Farm, jobs: int, processors: int, seed: int = 0) -> Night:
    """All jobs wait at the beginning, as those of a build do."""
    rng = random.Random(seed)
    nodes = -(-processors // farm.node)
    half = farm.database / 2.0
    events = [(0.0, processor, -1.0) for processor in range(processors)]  # time, who, begun
    heapify(events)
    waiting, running, repeated, now = jobs, 0, 0, 0.0
    database_free = database_busy = 0.0
    while events and (waiting or running):
        now, processor, begun = heappop(events)
        if begun >= 0.0:
            running -= 1
            lost = _lost_between(farm, nodes, processor // farm.node, begun, now)
            if lost is not None:
                waiting, repeated = waiting + 1, repeated + 1
                heappush(events, (max(now, lost + farm.away), processor, -1.0))
                continue
            database_free = max(now, database_free) + half
            database_busy += half
            heappush(events, (database_free, processor, -1.0))
        elif waiting:
            waiting, running = waiting - 1, running + 1
            database_free = max(now, database_free) + half
            database_busy += half
            took = rng.choice(farm.job_seconds) + farm.overhead
            heappush(events, (database_free + took, processor, now))
    end = max(now, database_free)
    return Night(end / _HOUR, repeated, database_busy / end)


def _lost_between(farm: Farm, nodes: int, node: int, begin: float, end: float) -> float | None:
    """When the node was lost while a job ran; they are lost by turns."""
    first = int(begin // farm.lost_every) + 1
    for number in range(first, int(end // farm.lost_every) + 1):
        if number % nodes == node:
            return number * farm.lost_every
    return None


def processors_for(farm: Farm, jobs: int, hours: float) -> tuple[int, Night]:
    """The fewest whole nodes that are done in time."""
    mean = sum(farm.job_seconds) / len(farm.job_seconds) + farm.overhead + farm.database
    nodes = max(1, int(jobs * mean / (hours * _HOUR) / farm.node))
    while True:
        night = simulate(farm, jobs, nodes * farm.node)
        if night.hours <= hours:
            return nodes * farm.node, night
        nodes += max(1, int(nodes * (night.hours / hours - 1.0)))
