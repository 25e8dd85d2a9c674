"""What a run has to say of each asset."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from simplifier.builds.figures import Figures


class State(StrEnum):
    """How an asset is at the end of a run."""

    CURRENT = "current"
    """As it was made before."""
    BUILT = "built"
    """Made by this run."""
    STALE = "stale"
    """To be made, and it was not: by a check, or because the run was interrupted."""
    FAILED = "failed"
    """It could not be made."""
    GONE = "gone"
    """Its mesh is there no more, and what was made of it is."""


@dataclass(frozen=True)
class Finding:
    """Of one asset.

    ``why``      it was made, is stale or failed; empty for one that is current.
    ``figures``  of the occluder that is there, if one is known.
    ``short``    how it falls short of what is demanded of it.
    ``seconds``  that making took.
    """

    asset: str
    state: State
    why: str = ""
    figures: Figures | None = None
    short: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def faults(self) -> tuple[str, ...]:
        """All that makes a run fail, in words."""
        bad = self.state in (State.STALE, State.FAILED, State.GONE)
        return ((f"{self.state}: {self.why}",) if bad else ()) + self.short
