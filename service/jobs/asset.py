"""Values: an asset, which is a name with its runs, and what is demanded of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from service.jobs.job import Job, Summary


@dataclass(frozen=True)
class Thresholds:
    """Least precision and recall of a run, 0 to 1; None demands nothing."""

    min_precision: float | None = None
    min_recall: float | None = None

    def held_by(self, summary: Summary) -> bool | None:
        """Whether a run is good enough; None when nothing is demanded."""
        pairs = [(self.min_precision, summary.precision), (self.min_recall, summary.recall)]
        asked = [(least, value) for least, value in pairs if least is not None]
        if not asked:
            return None
        return all(value is not None and value >= least for least, value in asked)


@dataclass(frozen=True)
class Asset:
    """A name of a tenant's, and the latest of its runs that succeeded."""

    tenant: str
    name: str
    created: float
    thresholds: Thresholds
    runs: int
    latest: Job | None


@dataclass(frozen=True)
class AssetPage:
    """Assets by name, and the name that the next page begins after; None on the last."""

    assets: tuple[Asset, ...]
    cursor: str | None


class AssetStore(Protocol):
    """Assets and their runs: jobs with a summary, oldest of them last."""

    def assets(
        self, tenant: str | None, *, contains: str = "", after: str | None = None, limit: int = 100
    ) -> AssetPage: ...

    def asset(self, tenant: str | None, name: str) -> Asset:
        """Raises :class:`~service.errors.NotFoundError`."""

    def history(
        self, tenant: str | None, name: str, *, before: int | None = None, limit: int = 100
    ) -> Sequence[Job]:
        """Its runs that succeeded, newest first.  Raises NotFoundError."""

    def set_thresholds(self, tenant: str, name: str, thresholds: Thresholds) -> Asset:
        """The asset is made when there is none."""

    def remove(self, tenant: str, name: str) -> None:
        """With its runs that have ended.  Raises NotFoundError; ConflictError while one has not."""
