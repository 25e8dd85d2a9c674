"""Values: an asset, which is a name with its runs, and what is demanded of it."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Protocol

from service.jobs.job import Failure, Job, Summary
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

    def over(self, wider: Thresholds) -> Thresholds:
        """These, and for each that is not set that of a wider circle."""
        return Thresholds(
            *(
                getattr(wider, one.name)
                if getattr(self, one.name) is None
                else getattr(self, one.name)
                for one in fields(self)
            )
        )


PROJECT = ""
"""The folder that all assets of a tenant lie in."""


def folders_of(name: str) -> Iterator[str]:
    """The folders that an asset lies in by its name, the nearest first, the project last."""
    folder = name
    while folder:
        folder = folder.rpartition("/")[0]
        yield folder


def demanded(own: Thresholds, name: str, folders: Mapping[str, Thresholds]) -> Thresholds:
    """What counts for an asset: its own thresholds, and for each that it does not set itself that
    of the nearest folder which does.  ``folders`` by their paths, without a slash at the end."""
    for folder in folders_of(name):
        if folder in folders:
            own = own.over(folders[folder])
    return own


def folder_path(text: str) -> str:
    """A folder as it is kept: composed, and without slashes around it.

    Raises ValueError as :func:`asset_name` does.
    """
    path = text.strip("/")
    return asset_name(path) if path else PROJECT


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
    ``thresholds``  its own; ``demanded`` those that count, as :func:`demanded` says.
    ``goes``  when it is removed for good, Unix seconds; None unless somebody has removed it.
    """

    id: str
    tenant: str
    name: str
    created: float
    thresholds: Thresholds
    demanded: Thresholds
    runs: int
    latest: Job | None
    goes: float | None = None


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
    """What a list of thousands of assets shows of a run.

    ``pictured``    whether it has a thumbnail.
    ``evaluation``  whether its occluder was made elsewhere, and measured here.
    """

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
    pictured: bool = False
    evaluation: bool = False


@dataclass(frozen=True, slots=True)
class Standing:
    """How an asset stands.

    ``thresholds``  its own; ``demanded`` those that count.
    ``recalls``  of its last runs, oldest first; those without one are left out.
    """

    id: str
    name: str
    thresholds: Thresholds
    latest: RunNumbers | None
    recalls: tuple[float, ...]
    demanded: Thresholds


@dataclass(frozen=True, slots=True)
class FailedUpload:
    """A job that failed and was not made good: the newest of its asset, or one without an asset.

    ``name``  of what was sent, as its owner calls it; ``ended`` in Unix seconds.
    """

    job_id: str
    name: str
    asset_id: str | None
    asset: str | None
    ended: float
    failure: Failure


@dataclass(frozen=True, slots=True)
class RemovedAsset:
    """An asset that was removed and can be restored until it ``goes``, Unix seconds."""

    id: str
    name: str
    goes: float


class AssetStore(Protocol):
    """Assets and their runs: jobs that succeeded, but for trade-offs, which make no occluder.

    A tenant of None sees all.  The journal says ``by`` whom thresholds were changed, or an asset
    was renamed, removed or restored.  Methods raise :class:`~service.errors.NotFoundError` for an
    asset that is not there or another's.  Lists leave out what somebody has removed.
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
        """Remove it with its jobs, at once and for good.

        Raises :class:`~service.errors.ConflictError` while one has not ended.
        """

    def remove_later(
        self, tenant: str | None, asset_id: str, goes: float, *, by: Actor = COMMAND_LINE
    ) -> Asset:
        """Leave it out of lists, and remove it as :meth:`remove` does once the time has come.

        A new run of its name restores it, as :meth:`restore` does.
        """

    def restore(self, tenant: str | None, asset_id: str, *, by: Actor = COMMAND_LINE) -> Asset:
        """Undo :meth:`remove_later`; nothing where nobody has removed it."""

    def removed(self, tenant: str) -> tuple[RemovedAsset, ...]:
        """What can be restored, by name."""

    def remove_due(self, now: float) -> int:
        """Remove for good what is due, of all tenants, but for those with a job that has not ended.

        Gives how many.
        """

    def rename(
        self, tenant: str | None, asset_id: str, name: str, *, by: Actor = COMMAND_LINE
    ) -> Asset:
        """Give it another name, as :func:`asset_name` has it; its runs stay its own.

        Raises :class:`~service.errors.ConflictError` where another asset has that name.
        """

    def folder_thresholds(self, tenant: str) -> Mapping[str, Thresholds]:
        """What is demanded of all assets in a folder, by its path; only of folders with any."""

    def set_folder_thresholds(
        self, tenant: str, folder: str, thresholds: Thresholds, *, by: Actor = COMMAND_LINE
    ) -> None:
        """``folder`` as :func:`folder_path` has it; :data:`PROJECT` is for all assets."""

    def failed(self, tenant: str, since: float) -> tuple[FailedUpload, ...]:
        """Newest first.  Of those without an asset, which ended since then and were not retried."""

    def standings(self, tenant: str, *, recalls: int = 20) -> tuple[Standing, ...]:
        """How all assets stand, by name; with the recalls of at most so many runs of each."""

    def runs_at(self, tenant: str, moment: float) -> Mapping[str, RunNumbers]:
        """The run that was an asset's latest at a time, in Unix seconds, by the asset's id."""

    def stamp(self, tenant: str) -> Hashable:
        """Another value once :meth:`standings` says something else; cheap to ask for."""
