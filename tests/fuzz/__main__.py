"""Fuzz for some time: ``python -m tests.fuzz [--seconds 600] [--seed 0] [TARGET ...]``.

The time is shared out among the targets, those of whole simplifications getting most of it.  Ends
with a table; exit status 1 where something failed, which ``out/fuzz/failures`` then holds.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from tests.fuzz.changed import fuzz_changed
from tests.fuzz.drawn import fuzz_drawn
from tests.fuzz.guided import fuzz_guided, installed
from tests.fuzz.tally import Tally
from tests.fuzz.targets import READERS, TARGETS, Target

_SHARES = {"simplify": 6.0, "evaluate": 2.0, "scene": 3.0}
"""Of the time; 1 for others."""

_TOLD_SECONDS = 20.0  # between two lines on one target


def main(arguments: Sequence[str] | None = None) -> int:
    given = _parsed(arguments)
    targets = [TARGETS[name] for name in given.targets or TARGETS]
    print(f"{given.seconds:g} s, seed {given.seed}, {given.engine} engine", flush=True)
    total = sum(_SHARES.get(target.name, 1.0) for target in targets)

    def fuzz(target: Target) -> Tally:
        share = _SHARES.get(target.name, 1.0) / total
        seconds = given.seconds * min(given.processes, len(targets)) * share
        engine = _engine(target, given.engine)
        return engine(target, given.seed, _until(time.monotonic() + seconds))

    # Long ones first, so that the processes end together.
    targets.sort(key=lambda target: -_SHARES.get(target.name, 1.0))
    with ThreadPoolExecutor(given.processes) as pool:
        tallies = list(pool.map(fuzz, targets))
    _print_table(tallies)
    return 1 if any(tally.findings for tally in tallies) else 0


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(TARGETS)}")
    parser.add_argument("--seconds", type=float, default=600.0, help="in all")
    parser.add_argument("--processes", type=int, default=1, help="targets at a time")
    parser.add_argument("--seed", type=int, default=0, help="another one tries other cases")
    parser.add_argument(
        "--engine", choices=("plain", "guided"), default="plain",
        help="guided takes atheris for the readers (pip install -e '.[fuzz]')",
    )  # fmt: skip
    given = parser.parse_args(arguments)
    unknown = [name for name in given.targets if name not in TARGETS]
    if unknown:
        parser.error(f"'{unknown[0]}' is no target; choose from {', '.join(TARGETS)}")
    if given.engine == "guided" and not installed():
        parser.error("atheris is not installed; pip install -e '.[fuzz]', or choose plain")
    return given


def _engine(target: Target, name: str) -> Callable[[Target, int, Callable[[Tally], bool]], Tally]:
    if target not in READERS:
        return fuzz_drawn
    return fuzz_guided if name == "guided" else fuzz_changed


def _until(end: float) -> Callable[[Tally], bool]:
    """Whether there is time left; tells how it goes now and then."""
    told = time.monotonic()

    def goes_on(tally: Tally) -> bool:
        nonlocal told
        now = time.monotonic()
        if now - told > _TOLD_SECONDS:
            told = now
            print(tally, flush=True)
        return now < end

    return goes_on


def _print_table(tallies: Sequence[Tally]) -> None:
    print("\n| target | cases | seconds | taken | refused | new in the corpus | faults |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for one in tallies:
        refused = one.cases - one.verdicts["taken"] - one.verdicts["fault"]
        cells = (one.cases, round(one.seconds), one.verdicts["taken"], refused, one.entries)
        print(f"| {one.target} | " + " | ".join(f"{cell:,}" for cell in cells), end="")
        print(f" | {len(one.findings)} |")
    for one in tallies:
        for finding in one.findings.values():
            print(
                f"\n{one.target}: {finding.fault}\n    python -m tests.fuzz.replay {finding.path}"
            )


if __name__ == "__main__":
    sys.exit(main())
