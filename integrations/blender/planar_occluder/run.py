"""What the command and the service have in common: one occluder under way."""

from dataclasses import dataclass, field
from typing import Any, Protocol


class RunError(Exception):
    """No occluder came of it; the text says why and what to do."""


@dataclass(frozen=True)
class Made:
    """An occluder's PLY and its report (``docs/report.schema.json``)."""

    ply: bytes
    report: dict[str, Any] = field(default_factory=dict)


class Run(Protocol):
    share: float | None
    """Of the work that is done, 0 to 1; None where it is not known."""

    def poll(self) -> Made | None:
        """What was made once it is; at once.  Raises RunError."""

    def cancel(self) -> None:
        """End it and leave nothing behind; also good after its end."""
