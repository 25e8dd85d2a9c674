"""MemoryNeed: the peak of a run before it begins, by stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

GIB = 1 << 30
MIB = 1 << 20

BASE_BYTES = 180 * MIB
"""Of a process that has done nothing yet: interpreter, libraries, and the kernels from their cache.
The first run on a machine compiles them and needs twice as much."""


@dataclass(frozen=True)
class MemoryNeed:
    """Bytes that a run holds at once, beside :data:`BASE_BYTES`, by stage in the order of the run.

    Each stage counts what earlier ones have left for later ones.  At least one stage.
    """

    stages: Mapping[str, int]

    @property
    def largest(self) -> str:
        """The stage that needs most, the first of equals."""
        return max(self.stages, key=lambda name: self.stages[name])

    @property
    def peak(self) -> int:
        """Bytes of the whole process in that stage."""
        return BASE_BYTES + self.stages[self.largest]

    @property
    def gib(self) -> float:
        """The peak in GiB."""
        return self.peak / GIB

    def beside(self, held: int) -> MemoryNeed:
        """The same where so many bytes are held by others all the while."""
        return MemoryNeed({name: held + count for name, count in self.stages.items()})

    def joined(self, other: MemoryNeed) -> MemoryNeed:
        """Of a run that does this and then the other; the larger where both have a stage."""
        both = dict(self.stages)
        for name, count in other.stages.items():
            both[name] = max(count, both.get(name, 0))
        return MemoryNeed(both)
