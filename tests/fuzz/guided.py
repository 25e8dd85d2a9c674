"""Readers by atheris: libFuzzer, guided by the branches that a case takes.

Optional, ``pip install -e '.[fuzz]'``.  It runs in ``guided_process.py``, a process of its own;
what it finds comes back as files, and is tried again and made smaller in the watched one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from tests.fuzz.corpus import GROWN, all_inputs
from tests.fuzz.tally import Tally
from tests.fuzz.targets import Target
from tests.fuzz.watched import Watched


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
    command = [sys.executable, "-m", "tests.fuzz.guided_process", target, str(seed), str(folder)]
    subprocess.run(
        command, env={**os.environ, "OCCLUDER_THREADS": "1"}, check=False,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
