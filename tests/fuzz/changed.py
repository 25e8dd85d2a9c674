"""Readers: files that are changed again and again, those first that reach new lines.

Needs nothing but Python.  The same seed and the same corpus give the same cases in the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from tests.fuzz.corpus import all_inputs, keep
from tests.fuzz.lines import Line
from tests.fuzz.tally import Tally
from tests.fuzz.targets import Target
from tests.fuzz.watched import Outcome, Watched

_WHOLE = 0.7
"""Of the cases: changed from a file that was taken, as most that reach new lines are refused."""


def fuzz_changed(target: Target, seed: int, goes_on: Callable[[Tally], bool]) -> Tally:
    """Until ``goes_on`` says no, which is asked after every case."""
    random = Random(f"{seed} {target.name}")
    entries: list[bytes] = []
    whole: list[bytes] = []
    tally = Tally(target.name)
    reached: set[Line] = set()

    def learn(data: bytes, outcome: Outcome) -> None:
        reached.update(outcome.lines)
        entries.append(data)
        if outcome.verdict == "taken":
            whole.append(data)

    with Watched(warm=target.name, records=True) as watched:
        for path in all_inputs(target.name):
            learn(path.read_bytes(), watched.tried(target.name, path.read_bytes()))
        while goes_on(tally):
            pool = whole if whole and random.random() < _WHOLE else entries
            data = target.mutated(random, random.choice(pool), random.choice(entries))
            outcome = watched.tried(target.name, data)
            tally.count(data, outcome, watched)
            if not outcome.lines <= reached:
                learn(data, outcome)
                keep(target.name, data)
                tally.entries += 1
    return tally
