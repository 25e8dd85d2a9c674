"""Readers by atheris: libFuzzer, guided by the branches that a case takes.

Optional, ``pip install -e '.[fuzz]'``; thousands of cases a second.  It runs in a process of its
own, ``python -m tests.fuzz.guided TARGET SECONDS SEED FOLDER``; what it finds comes back as files
and is tried again, and made smaller, in the watched one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from random import Random

from tests.fuzz.corpus import CORPUS, FIXTURES, GROWN, all_inputs, digest
from tests.fuzz.tally import Tally
from tests.fuzz.targets import Target
from tests.fuzz.watched import Watched

_GUIDED_BY = ("simplifier.io", "simplifier.geometry", "simplifier.hierarchy")
"""Whose branches count; kernels are compiled by numba, which takes no other compiler's code."""

_MEGABYTES = 4096
_LONGEST = 1 << 14  # bytes of a case
_STEP_SECONDS = 60.0


def installed() -> bool:
    """Whether atheris is there."""
    return find_spec("atheris") is not None


def fuzz_guided(target: Target, seed: int, goes_on: Callable[[Tally], bool]) -> Tally:
    """Until ``goes_on`` says no, which is asked every minute.

    libFuzzer ends at a hang or a crash; each step begins anew, with another seed and what the
    corpus has become.
    """
    tally = Tally(target.name)
    before = len(all_inputs(target.name))
    (GROWN / target.name).mkdir(parents=True, exist_ok=True)
    with Watched(warm=target.name) as watched:
        while goes_on(tally):
            with tempfile.TemporaryDirectory(prefix="occluder-guided-") as folder:
                _step(target.name, seed, Path(folder))
                verdicts = Path(folder, "verdicts")
                if verdicts.exists():
                    found = json.loads(verdicts.read_text())
                    tally.verdicts.update(found)
                    tally.cases += sum(found.values())
                for path in sorted(Path(folder).glob("*-*")):
                    data = path.read_bytes()
                    tally.count(data, watched.tried(target.name, data), watched)
            tally.entries = len(all_inputs(target.name)) - before
            seed += 1
    return tally


def _step(target: str, seed: int, folder: Path) -> None:
    command = [sys.executable, "-m", "tests.fuzz.guided", target, str(seed), str(folder)]
    subprocess.run(
        command, env={**os.environ, "OCCLUDER_THREADS": "1"}, check=False,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def main() -> None:
    """In the process of its own; never returns."""
    import atheris

    name, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    with atheris.instrument_imports(include=_GUIDED_BY):
        from tests.fuzz.targets import TARGETS
    from tests.fuzz.watched import fault_of, limit_memory

    target = TARGETS[name]
    inputs = [path.read_bytes() for path in all_inputs(name)]
    work = Path(tempfile.mkdtemp(dir=folder))
    verdicts: dict[str, int] = {}
    told = 0.0

    def attempt(data: bytes) -> None:
        nonlocal told
        try:
            verdict = target.verdict(data, work)
        except Exception as error:
            verdict = "fault"
            (folder / f"fault-{digest(fault_of(error))}").write_bytes(data)
        verdicts[verdict] = verdicts.get(verdict, 0) + 1
        if time.monotonic() - told > 1.0:
            told = time.monotonic()
            (folder / "verdicts").write_text(json.dumps(verdicts))

    def change(data: bytes, most: int, number: int) -> bytes:
        random = Random(number)
        if random.random() < 0.5:
            return bytes(atheris.Mutate(data, most))
        return target.mutated(random, data, random.choice(inputs))[:most]

    limit_memory()
    arguments = [
        sys.argv[0], str(GROWN / name), *(str(place / name) for place in (CORPUS, FIXTURES)
        if (place / name).exists()), f"-seed={seed}", f"-max_total_time={_STEP_SECONDS:.0f}",
        f"-timeout={target.seconds:.0f}", f"-rss_limit_mb={_MEGABYTES}", f"-max_len={_LONGEST}",
        f"-artifact_prefix={folder}/", "-verbosity=0",
    ]  # fmt: skip
    atheris.Setup(arguments, attempt, custom_mutator=change)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
