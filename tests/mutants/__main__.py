"""`make mutants`: small mistakes in what promises safety, and whether the tests near them see each.

A tester of our own, for three things that those at hand (mutmut, cosmic-ray, mutatest) do not do
together.  Half of the targets are numba kernels: mutmut calls the mutant through a dispatcher that
numba cannot compile, and forks, which threads do not survive; numba's cache on disk does not see
that a kernel in another file has changed, so mutated kernels run as plain Python here.  Each target
has its own tests, where cosmic-ray has one command for all and writes mutants into the checkout.
And a process a mutant costs seconds of imports for tests of milliseconds: here a worker collects
its tests once and swaps the code of functions (:mod:`tests.mutants.swapping`), so nothing on disk
is mutated at all.

    python -m tests.mutants [--only WORD ...] [--processes 2] [--seconds 300] [--list]

A mutant that takes several times as long as the tests, or ends its worker, is caught too.  Those
that cannot be found because they change nothing that is promised stand in ``equivalents.toml`` with
the reason.  Exit status 1 when another survives, or when an entry there fits no survivor.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import select
import signal
import subprocess
import sys
import threading
import time
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.mutants.targets import TARGETS, Target
from tests.mutants.worker import chosen

EQUIVALENTS = Path(__file__).parent / "equivalents.toml"
_KINDS = ("killed", "equivalent", "survived", "untried")
_PER_JOB = 130  # mutants of one worker, which costs its imports and two runs of all tests
_START_SECONDS = 300.0  # for imports and the first run of all tests

Key = tuple[str, str, str, str | None, int]
"""File, function, statement without and with the mistake, number; None for any mistake in it."""


@dataclass
class Outcome:
    """Of one target: how each of its mutants was found, by number; None for a survivor."""

    target: Target
    found: dict[int, str | None] = field(default_factory=dict)
    fault: str = ""


class Worker:
    """A process that tries some mutants, started again where one ends it or takes too long."""

    def __init__(self, outcome: Outcome, numbers: list[int], seconds: float) -> None:
        self._outcome, self._left, self._seconds = outcome, numbers, seconds
        self._known: dict[str, Any] = {}
        self._found: Counter[str] = Counter()

    def run(self) -> None:
        while self._left and not self._outcome.fault:
            ended = self._run_once()
            if ended is None:
                return
            self._left.remove(ended[0])
            self._outcome.found[ended[0]] = ended[1]

    def _run_once(self) -> tuple[int, str] | None:
        """The mutant that ended the process and how, or None where all were tried."""
        with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            return self._run_in(folder)

    def _run_in(self, folder: str) -> tuple[int, str] | None:
        receiving, sending = os.pipe()
        target = self._outcome.target
        job = {
            "file": target.file, "functions": target.functions, "tests": target.tests,
            "numbers": self._left, "found": self._found, "folder": f"{folder}/tests", **self._known,
        }  # fmt: skip
        environment = dict(os.environ, HYPOTHESIS_PROFILE="mutants", OCCLUDER_THREADS="1")
        if not target.compiled:
            environment["NUMBA_DISABLE_JIT"] = "1"
        command = [sys.executable, "-m", "tests.mutants.worker", str(sending), json.dumps(job)]
        with subprocess.Popen(
            command, pass_fds=[sending], env=environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process:  # fmt: skip
            os.close(sending)
            output: list[bytes] = []
            reader = threading.Thread(target=lambda: output.append(process.stdout.read()))  # type: ignore[union-attr]
            reader.start()
            try:
                ended = self._follow(receiving, process, output)
                if ended is not None and process.poll() == -signal.SIGPROF:
                    return ended[0], "the time limit"
                return ended
            finally:
                process.kill()
                reader.join()
                os.close(receiving)

    def _follow(
        self, receiving: int, process: subprocess.Popen[bytes], output: list[bytes]
    ) -> tuple[int, str] | None:
        trying: int | None = None
        checks = 0
        rest = b""
        while True:
            limit = _START_SECONDS if trying is None else self._seconds
            if not select.select([receiving], [], [], limit)[0]:
                if trying is None:
                    self._outcome.fault = "the tests take too long"
                    return None
                return trying, "the time limit"
            data = os.read(receiving, 1 << 16)
            if not data:
                process.wait()
                if trying is not None:
                    return trying, "the end of its process"
                if not checks and not self._outcome.fault:
                    time.sleep(0.1)
                    told = b"".join(output).decode(errors="replace")[-2000:]
                    self._outcome.fault = f"the worker ended early: {told}"
                return None
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                event = json.loads(line)
                if "begin" in event:
                    trying = event["begin"]
                elif "end" in event:
                    trying = None
                    self._left.remove(event["end"])
                    self._outcome.found[event["end"]] = event["found"]
                    if event["found"] is None:
                        print(f"survives: {self._outcome.target.file}:{event['text']}", flush=True)
                    else:
                        self._found[event["found"]] += 1
                else:
                    checks += event["when"] == "after"
                    self._known["seconds"] = event["seconds"]
                    self._check(event)

    def _check(self, event: dict[str, Any]) -> None:
        if event["failing"]:
            self._outcome.fault = (
                f"without a mutant, {event['when']} them, fails: {', '.join(event['failing'])}"
            )


def run_all(targets: Sequence[Target], processes: int, seconds: float) -> list[Outcome]:
    """Try all mutants of some targets, the largest first."""
    outcomes = [Outcome(target) for target in targets]
    jobs = []
    for outcome in outcomes:
        source = Path(outcome.target.file).read_text()
        numbers = [number for number, _ in chosen(source, outcome.target.functions)]
        parts = -(-len(numbers) // _PER_JOB)
        jobs += [Worker(outcome, numbers[part::parts], seconds) for part in range(parts)]
    waiting: queue.SimpleQueue[Worker] = queue.SimpleQueue()
    for job in sorted(jobs, key=lambda job: -len(job._left)):
        waiting.put(job)

    def work() -> None:
        while True:
            try:
                job = waiting.get_nowait()
            except queue.Empty:
                return
            job.run()

    threads = [threading.Thread(target=work) for _ in range(processes)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return outcomes


def read_equivalents(path: Path = EQUIVALENTS) -> dict[Key, str]:
    """Mutant -> why no test can find it."""
    entries = tomllib.loads(path.read_text()).get("equivalent", [])
    return {
        (one["file"], one["function"], one["before"], one.get("after"), one.get("number", 1)): one[
            "reason"
        ]
        for one in entries
    }


def report(outcomes: Sequence[Outcome], equivalents: dict[Key, str]) -> int:
    """Print survivors and a table; the exit status."""
    files = {one.target.file for one in outcomes}
    unused = {key for key in equivalents if key[0] in files}
    faults, rows = [one for one in outcomes if one.fault], []
    for outcome in outcomes:
        file, kinds = outcome.target.file, Counter[str]()
        for number, mutant in chosen(Path(file).read_text(), outcome.target.functions):
            function, before, after, times = mutant.key
            one, any_of_it = (
                (file, function, before, after, times),
                (file, function, before, None, 1),
            )
            if number not in outcome.found:
                kinds["untried"] += 1
            elif outcome.found[number] is not None:
                kinds["killed"] += 1
            elif one in equivalents or any_of_it in equivalents:
                kinds["equivalent"] += 1
                unused -= {one, any_of_it}
            else:
                kinds["survived"] += 1
                print(f"{file}:{mutant}\n")
        rows.append((file, [kinds.total(), *(kinds[kind] for kind in _KINDS)]))
    for outcome in faults:
        print(f"{outcome.target.file}: {outcome.fault}")
    for key in sorted(unused, key=str):
        print(f"listed as equivalent, and no survivor: {key}")
    rows.append(("in all", [sum(column) for column in zip(*(row for _, row in rows), strict=True)]))
    for name, cells in (("", ["mutants", *_KINDS]), *rows):
        print(f"{name:40}" + "".join(f"{cell:>12}" for cell in cells))
    survived = rows[-1][1][1 + _KINDS.index("survived")]
    return int(bool(faults or unused or survived))


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("--only", nargs="+", default=[""], help="targets that hold one of these")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="until a mutant counts as stuck"
    )
    parser.add_argument("--list", action="store_true", help="show the mutants, try none")
    asked = parser.parse_args(words)
    targets = [one for one in TARGETS if any(word in one.file for word in asked.only)]
    if not targets:
        parser.error(f"no target's file holds any of: {', '.join(asked.only)}; --list shows all")
    if asked.list:
        for target in targets:
            for _, mutant in chosen(Path(target.file).read_text(), target.functions):
                print(f"{target.file}:{mutant}\n")
        return 0
    begin = time.monotonic()
    status = report(run_all(targets, asked.processes, asked.seconds), read_equivalents())
    print(f"{time.monotonic() - begin:.0f} s")
    return status


if __name__ == "__main__":
    sys.exit(main())
