"""libFuzzer on one target for a minute: ``python -m tests.fuzz.guided_process TARGET SEED FOLDER``.

Into the folder go ``verdicts``, how often each was given, and the inputs that failed: ``fault-…``
of this module's, ``timeout-…``, ``crash-…`` and ``oom-…`` of libFuzzer's.  New inputs go to the
grown corpus.  Imports the library itself, so that its branches can be watched.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from random import Random

import atheris

import simplifier.kernels
from tests.fuzz.corpus import CORPUS, FIXTURES, GROWN, all_inputs, digest

_GUIDED_BY = ["simplifier.io", "simplifier.geometry", "simplifier.hierarchy"]
"""Whose branches count."""

_SECONDS = 60
_MEGABYTES = 4096
_LONGEST = 1 << 14  # bytes of a case


def main() -> None:
    """Never returns."""
    name, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    for kernel in iter_modules(simplifier.kernels.__path__):
        import_module(f"simplifier.kernels.{kernel.name}")  # as they are: numba has to read them
    with atheris.instrument_imports(include=_GUIDED_BY):
        from tests.fuzz.targets import target_named
        from tests.fuzz.watched import fault_of, limit_memory

    target = target_named(name)
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
        if (place / name).exists()), f"-seed={seed}", f"-max_total_time={_SECONDS}",
        f"-timeout={target.seconds:.0f}", f"-rss_limit_mb={_MEGABYTES}", f"-max_len={_LONGEST}",
        f"-artifact_prefix={folder}/", "-verbosity=0",
    ]  # fmt: skip
    atheris.Setup(arguments, attempt, custom_mutator=change)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
