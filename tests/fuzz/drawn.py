"""Meshes and options: cases drawn by hypothesis, which knows them from ``tests/strategies``.

Hypothesis only draws here.  Cases are tried in the watched process, where one may hang or crash,
and made smaller by ``minimise.py`` as others are.
"""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded

from tests.fuzz.cases import Case, write_case
from tests.fuzz.tally import Tally
from tests.fuzz.targets import Target
from tests.fuzz.watched import Watched
from tests.strategies.cases import evaluate_cases, scene_cases, simplify_cases

CASES = {
    "simplify": simplify_cases(),
    "evaluate": evaluate_cases(),
    "scene": scene_cases(),
}
"""What the cases of a target are drawn from."""

_ROUND = 50  # cases; later ones of a round repeat parts of earlier ones

_DRAWING = settings(
    max_examples=_ROUND, database=None, deadline=None, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


def fuzz_drawn(target: Target, seed: int, goes_on: Callable[[Tally], bool]) -> Tally:
    """Until ``goes_on`` says no, which is asked after every case."""
    tally = Tally(target.name)
    rounds = 0
    with Watched(warm=target.name) as watched:

        def attempt(case: Case) -> None:
            if goes_on(tally):
                data = write_case(case)
                tally.count(data, watched.tried(target.name, data), watched)

        while goes_on(tally):
            round_of = seeded(seed * 1_000_003 + rounds)
            round_of(_DRAWING(given(CASES[target.name])(attempt)))()
            rounds += 1
    return tally
