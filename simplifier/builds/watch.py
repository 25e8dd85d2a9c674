"""Builds again and again, each time that something changes below the manifest's folder."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path

from watchfiles import Change, watch

from simplifier.builds.build import build_assets
from simplifier.builds.digests import Digests
from simplifier.builds.finding import Finding, State
from simplifier.builds.making import Maker
from simplifier.builds.record import read_record, record_path
from simplifier.errors import ManifestError, OccluderError
from simplifier.io.places import followed, is_folder
from simplifier.progress import Cancel

_QUIET = 200  # ms without a change: until then a file may be half written
_LONGEST = 5000  # ms of changes after which they are looked at all the same
_GLANCE = 500  # ms between two ends of waiting

Refused = Callable[[OccluderError], None]


def watch_assets(
    path: Path,
    cancel: Cancel,
    *,
    found: Callable[[Finding], None],
    refused: Refused,
    maker: Maker | None = None,
    at_once: int | None = None,
) -> None:
    """Keep the outputs of a manifest current until ``cancel`` is set.

    ``found``    hears of each asset that was made, of what is wrong with one, once, and of one that
                 is as it was before it went wrong.
    ``refused``  hears why nothing can be made, such as a bad manifest, once.

    A mesh that cannot be read, half written perhaps, is tried again when something in its folder
    changes.  What was made of one that is there no more stays: it may be back in a moment.  Raises
    :class:`ManifestError` where there is no folder to watch.
    """
    if not is_folder(followed(path).parent):
        raise ManifestError("there is no such folder", where=str(path), remedy="check the path")
    told = _Told(found, refused)
    digests, failed = Digests(), frozenset[str]()
    for changed in _changes(path, cancel):
        try:
            findings = build_assets(
                path, cancel, maker=maker, at_once=at_once, digests=digests,
                skipped=_failed_and_untouched(path, failed, changed), tidy=False,
            )  # fmt: skip
        except OccluderError as error:
            told.refusal(error)
            continue
        if cancel.is_set():
            return
        told.findings(findings)
        failed = frozenset(one.asset for one in findings if one.state is State.FAILED)


def _changes(path: Path, cancel: Cancel) -> Iterator[Collection[Path] | None]:
    """Paths that have changed, resolved; None at first, and once more, for what has changed before
    the watch began."""
    yield None
    folder, record = followed(path).parent, record_path(followed(path))

    def counts(change: Change, name: str) -> bool:
        place = Path(name)
        hidden = any(one.startswith(".") for one in place.relative_to(folder).parts)
        return place != record and not hidden

    begun = False
    for changes in watch(
        folder, watch_filter=counts, debounce=_LONGEST, step=_QUIET, rust_timeout=_GLANCE,
        yield_on_timeout=True, stop_event=cancel, raise_interrupt=False,
    ):  # fmt: skip
        if not begun:
            begun = True
            yield None
        elif changes:
            yield frozenset(Path(name) for _, name in changes)


def _failed_and_untouched(
    path: Path, failed: Collection[str], changed: Collection[Path] | None
) -> Collection[str]:
    """Those that failed and will again: beside them nothing changed but outputs."""
    if not failed or changed is None or followed(path) in changed:
        return ()
    folder = followed(path).parent
    record = read_record(record_path(path))
    outputs = {folder / file for entry in record.values() for file in entry.outputs}
    touched = {one.parent for one in changed if one not in outputs}
    return {name for name in failed if (folder / name).parent not in touched}


class _Told:
    """What the user has heard, so as not to say it again."""

    def __init__(self, found: Callable[[Finding], None], refused: Refused) -> None:
        self._found, self._refused = found, refused
        self._last: dict[str, Finding] = {}
        self._refusal = ""

    def refusal(self, error: OccluderError) -> None:
        if str(error) != self._refusal:
            self._refused(error)
        self._refusal = str(error)

    def findings(self, findings: Collection[Finding]) -> None:
        self._refusal = ""
        for one in findings:
            if one.state is State.STALE:  # it failed before, as was said
                continue
            before, said = self._last.get(one.asset), replace(one, seconds=0.0)
            mended = before is not None and bool(before.faults) and not one.faults
            if one.state is State.BUILT or mended or (one.faults and said != before):
                self._found(one)
            self._last[one.asset] = said
