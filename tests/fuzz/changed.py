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
from tests.fuzz.watched import Watched

_RECENT = 0.3  # of the cases: changed from one of the last entries
_LAST = 8


def fuzz_changed(target: Target, seed: int, goes_on: Callable[[Tally], bool]) -> Tally:
    """Until ``goes_on`` says no, which is asked after every case."""
    random = Random(f"{seed} {target.name}")
    entries = [path.read_bytes() for path in all_inputs(target.name)]
    tally = Tally(target.name)
    reached: set[Line] = set()
    with Watched(warm=target.name, records=True) as watched:
        for data in entries:
            reached |= watched.tried(target.name, data).lines
        while goes_on(tally):
            pool = entries[-_LAST:] if random.random() < _RECENT else entries
            data = target.mutated(random, random.choice(pool), random.choice(entries))
            outcome = watched.tried(target.name, data)
            tally.count(data, outcome, watched)
            if not outcome.lines <= reached:
                reached |= outcome.lines
                entries.append(data)
                keep(target.name, data)
                tally.entries += 1
    return tally
