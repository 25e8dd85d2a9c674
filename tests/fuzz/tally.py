"""What a run over one target came to."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field

from tests.fuzz.findings import Finding, record
from tests.fuzz.watched import Outcome, Watched


@dataclass
class Tally:
    """Counts of a run, kept up to date as it goes on.

    ``verdicts``  how often a case was taken, and each kind of refusal.
    ``entries``   inputs that were new to the corpus.
    ``findings``  one for each fault, by the fault.
    """

    target: str
    cases: int = 0
    entries: int = 0
    seconds: float = 0.0
    verdicts: Counter[str] = field(default_factory=Counter)
    findings: dict[str, Finding] = field(default_factory=dict)
    _begin: float = field(default_factory=time.monotonic)

    def count(self, data: bytes, outcome: Outcome, watched: Watched) -> None:
        """One case; a fault that is not known yet is made small and written."""
        self.cases += 1
        self.verdicts[outcome.verdict or "fault"] += 1
        if outcome.fault and outcome.fault not in self.findings:
            self.findings[outcome.fault] = record(self.target, data, outcome, watched)
            print(f"{self.target}: {outcome.fault}\n    {self.findings[outcome.fault].path}")
        self.seconds = time.monotonic() - self._begin

    def __str__(self) -> str:
        rate = self.cases / max(self.seconds, 1e-9)
        return (
            f"{self.target}: {self.cases:,} cases in {self.seconds:.0f} s ({rate:,.0f} a second), "
            f"{self.verdicts['taken']:,} taken, {self.entries} new in the corpus, "
            f"{len(self.findings)} faults"
        )
