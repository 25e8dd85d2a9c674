"""How the time of reading grows with the bytes: ``python -m tests.fuzz.growth [NAME ...]``.

Each of ``worst_cases.py`` is read at doubling sizes, and an exponent is fitted to the processor
time against the bytes.  What grows by more than :data:`STEEPEST`, and is not cheap, is a small file
that costs hours.
Ends with a table, and with exit status 1 where one is too steep.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simplifier.errors import OccluderError
from tests.fuzz.worst_cases import WORST_CASES, WorstCase

STEEPEST = 1.3
_CHEAP = 0.5
"""Seconds a megabyte, below which growth is of caches, or on its way to a bound on the work."""

_LEAST = 1 << 13  # bytes
_NOISE = 2e-3  # seconds, below which nothing is said of growth
_FITTED = 4  # sizes, the largest


@dataclass(frozen=True)
class Growth:
    """Seconds of processor time by bytes, and the exponent; 0 where all were over in no time."""

    name: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]

    @property
    def exponent(self) -> float:
        pairs = [
            (size, seconds)
            for size, seconds in zip(self.sizes, self.seconds, strict=True)
            if seconds > _NOISE
        ][-_FITTED:]
        if len(pairs) < 3:
            return 0.0
        sizes, seconds = np.log(np.array(pairs)).T
        return float(np.polyfit(sizes, seconds, 1)[0])

    @property
    def too_steep(self) -> bool:
        return self.exponent > STEEPEST and self.per_megabyte > _CHEAP

    @property
    def per_megabyte(self) -> float:
        """Seconds a megabyte, of the largest."""
        return self.seconds[-1] / self.sizes[-1] * 1e6


def growth_of(case: WorstCase, folder: Path, *, largest: int, enough: float) -> Growth:
    """Read at doubling sizes up to ``largest`` bytes, or until one takes ``enough`` seconds."""
    path = folder / f"case{case.suffix}"
    sizes, seconds = [], []
    _read(case, path, case.make(_LEAST // 2))  # kernels are compiled before
    size = _LEAST
    while size <= largest:
        data = case.make(size)
        taken = min(_read(case, path, data) for _ in range(2))
        sizes.append(len(data))
        seconds.append(taken)
        if taken > enough:
            break
        size *= 2
    return Growth(case.name, tuple(sizes), tuple(seconds))


def _read(case: WorstCase, path: Path, data: bytes) -> float:
    path.write_bytes(data)
    begin = time.process_time()
    with suppress(OccluderError):
        case.read(path)
    return time.process_time() - begin


def main(names: Sequence[str] | None = None) -> int:
    wanted = sys.argv[1:] if names is None else names
    cases = [case for name, case in WORST_CASES.items() if not wanted or name in wanted]
    print("| worst case | bytes | seconds a megabyte | exponent |\n|---|---:|---:|---:|")
    steep = False
    with tempfile.TemporaryDirectory(prefix="occluder-growth-") as folder:
        for case in cases:
            found = growth_of(case, Path(folder), largest=4 << 20, enough=1.0)
            steep |= found.too_steep
            print(
                f"| {found.name} | {found.sizes[-1]:,} | {found.per_megabyte:.2f} |"
                f" {found.exponent:.2f}{' TOO STEEP' if found.too_steep else ''} |",
                flush=True,
            )
    return 1 if steep else 0


if __name__ == "__main__":
    sys.exit(main())
