"""Values: an asset, which is a name with its runs, and what is demanded of it."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Protocol

from service.jobs.job import Job, Summary
from service.journal import COMMAND_LINE, Actor


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Least precision and recall of a run, and most overhang; shares, None demands nothing."""

    min_precision: float | None = None
    min_recall: float | None = None
    max_overhang: float | None = None

    def held_by(self, run: Summary | RunNumbers) -> bool | None:
        """Whether a run is good enough; None when nothing is demanded.

        A figure that a run does not have, as those of before it was kept, holds nothing.
        """
        pairs = [(self.min_precision, run.precision), (self.min_recall, run.recall)]
        held = [value is not None and value >= least for least, value in pairs if least is not None]
        if self.max_overhang is not None:
            held.append(run.overhang is not None and run.overhang <= self.max_overhang)
        return all(held) if held else None


LONGEST_NAME = 300
"""Characters of an asset's name."""

_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of Unicode: controls, direction marks, halves of pairs, ends of lines, paragraphs."""

_JOINERS = "\u200c\u200d"
"""Unseen, too, but scripts are spelled by them, and emoji are made of them."""


def asset_name(text: str) -> str:
    """An asset's name as it is kept: composed (NFC), so that what looks the same is the same.

    Raises ValueError that says what is wrong with one that nobody could type, or tell from others.
    """
    name = unicodedata.normalize("NFC", text)
    if not 1 <= len(name) <= LONGEST_NAME:
        raise ValueError(f"it has {len(name)} characters, and may have 1 to {LONGEST_NAME}")
    unseen = [one for one in name if unicodedata.category(one) in _UNSEEN and one not in _JOINERS]
    if unseen:
        raise ValueError(f"it holds U+{ord(unseen[0]):04X}, which cannot be seen")
    if name != name.strip():
        raise ValueError("it begins or ends with a space")
    if not name.strip(_JOINERS):
        raise ValueError("nothing of it can be seen")
    return name


@dataclass(frozen=True)
class Asset:
    """A name of a tenant's, and the latest of its runs that succeeded.

    ``name``  as :func:`asset_name` has it, slashes among it; ``id`` is for addresses.
    """

    id: str
    tenant: str
    name: str
    created: float
    thresholds: Thresholds
    runs: int
    latest: Job | None


@dataclass(frozen=True)
class AssetPage:
    """Assets by name, and the cursor of the next page; None on the last."""

    assets: tuple[Asset, ...]
    cursor: str | None


@dataclass(frozen=True)
class RunPage:
    """Runs of an asset, newest first, and the cursor of the next page; None on the last."""

    runs: tuple[Job, ...]
    cursor: int | None


@dataclass(frozen=True, slots=True)
class RunNumbers:
    """What a list of thousands of assets shows of a run."""

    job_id: str
    created: float
    triangles: int
    input_triangles: int
    seconds: float
    precision: float | None
    recall: float | None
    worst_recall: float | None
    worst_view: int | None
    overhang: float | None
    verdict: str | None


@dataclass(frozen=True, slots=True)
class Standing:
    """How an asset stands.

    ``recalls``  of its last runs, oldest first; those without one are left out.
    """

    id: str
    name: str
    thresholds: Thresholds
    latest: RunNumbers | None
    recalls: tuple[float, ...]


class AssetStore(Protocol):
    """Assets and their runs: jobs that succeeded, but for trade-offs, which make no occluder.

    A tenant of None sees all.  The journal says ``by`` whom thresholds were changed, or an asset
    was removed.  Methods raise :class:`~service.errors.NotFoundError` for an asset that is not
    there or another's.
    """

    def assets(
        self,
        tenant: str | None,
        *,
        name: str | None = None,
        contains: str = "",
        after: str | None = None,
        limit: int = 100,
    ) -> AssetPage:
        """Assets of a name exactly, or with some text in their name, whatever its case."""

    def asset(self, tenant: str | None, asset_id: str) -> Asset: ...

    def runs(
        self, tenant: str | None, asset_id: str, *, before: int | None = None, limit: int = 100
    ) -> RunPage: ...

    def put(
        self,
        tenant: str,
        name: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
        before_change: Callable[[], None] = lambda: None,
    ) -> tuple[Asset, bool]:
        """Make the asset, or change what is demanded of it; whether it was made.

        ``before_change`` is called before what is demanded becomes another; what it raises undoes
        all.
        """

    def set_thresholds(
        self,
        tenant: str | None,
        asset_id: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
    ) -> Asset: ...

    def remove(self, tenant: str | None, asset_id: str, *, by: Actor = COMMAND_LINE) -> None:
        """Remove it with its jobs.

        Raises :class:`~service.errors.ConflictError` while one has not ended.
        """

    def standings(self, tenant: str, *, recalls: int = 20) -> tuple[Standing, ...]:
        """How all assets stand, by name; with the recalls of at most so many runs of each."""

    def runs_at(self, tenant: str, moment: float) -> Mapping[str, RunNumbers]:
        """The run that was an asset's latest at a time, in Unix seconds, by the asset's id."""

    def stamp(self, tenant: str) -> Hashable:
        """Another value once :meth:`standings` says something else; cheap to ask for."""
