"""One process that tries the mutants of one file: `python -m tests.mutants.worker FD JOB`.

JOB is JSON: ``file``, ``functions``, ``tests``, a ``folder`` for what they write, and the
``numbers`` of the mutants to try, of those that :func:`chosen` counts; ``seconds`` that each test
took and how many each has ``found`` where an earlier process knows.  What happens is written to the
file descriptor FD, JSON by the line.

The tests are collected once and run again and again within one process, each with its fixtures made
anew, the ones first that have found most mutants.  A mutant that takes several times as long as all
tests without it ends the process.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from tests.mutants.operators import Mutant, mutants
from tests.mutants.swapping import functions_of, swapped

_MEMORY = 6 << 30  # bytes of address space: a mutant may ask for anything
_LEAST_SECONDS, _TIMES = 3.0, 4.0  # of the processor, for one mutant: others may be busy with it


def chosen(source: str, functions: Sequence[str]) -> Iterator[tuple[int, Mutant]]:
    """The mutants of the named functions and constants, or all where none is named; counted."""
    number = 0
    for mutant in mutants(source):
        owner = mutant.name or mutant.function
        if not functions or any(owner == one or owner.startswith(f"{one}.") for one in functions):
            yield number, mutant
            number += 1


class Trials:
    """The plugin that takes the place of pytest's own loop over the tests."""

    def __init__(self, job: dict[str, Any], channel: int) -> None:
        self._job, self._channel = job, channel
        self._found: Counter[str] = Counter(job.get("found", {}))
        self._seconds: dict[str, float] = dict(job.get("seconds", {}))

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        path = Path(self._job["file"])
        module = importlib.import_module(".".join(path.with_suffix("").parts))
        functions = functions_of(str(module.__file__))
        items = [item for item in session.items if not item.get_closest_marker("skip")]
        if not items or not (self._seconds or self._check(items, "before")):
            return True
        wanted = set(self._job["numbers"])
        for number, mutant in chosen(path.read_text(), self._job["functions"]):
            if number in wanted:
                self._try(number, mutant, module, functions, items)
        self._check(items, "after")
        return True

    def _try(
        self, number: int, mutant: Mutant, module: Any, functions: list[FunctionType],
        items: list[pytest.Item],
    ) -> None:  # fmt: skip
        self._say(begin=number)
        limit = max(_LEAST_SECONDS, _TIMES * sum(self._seconds.values()))
        signal.setitimer(signal.ITIMER_PROF, limit)
        with swapped(mutant, module, functions) as changed:
            items.sort(key=lambda item: (-self._found[item.nodeid], self._seconds[item.nodeid]))
            found = next((item.nodeid for item in items if self._fails(item)), None)
        if found is not None:
            self._found[found] += 1
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        text = "" if found else str(mutant)
        self._say(end=number, found=found, text=text, changed=changed)

    def _check(self, items: list[pytest.Item], when: str) -> bool:
        """Whether all tests pass without a mutant, which is told too."""
        failing = []
        for item in items:
            begin = time.process_time()
            if self._fails(item):
                failing.append(item.nodeid)
            self._seconds.setdefault(item.nodeid, time.process_time() - begin)
        self._say(when=when, failing=failing, seconds=self._seconds)
        return not failing

    def _fails(self, item: pytest.Item) -> bool:
        return any(report.failed for report in runtestprotocol(item, nextitem=None, log=False))

    def _say(self, **words: object) -> None:
        os.write(self._channel, json.dumps(words).encode() + b"\n")


def main(channel: int, job: dict[str, Any]) -> int:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    options = ["-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:warnings"]
    options += ["--basetemp", job["folder"], *job["tests"]]  # others clean up what is shared
    return int(pytest.main(options, plugins=[Trials(job, channel)]))


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), json.loads(sys.argv[2])))
