"""Manifest to current outputs: what is stale is made, and recorded as soon as it is there."""

from __future__ import annotations

import posixpath
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from simplifier.builds.asset_plan import Asset
from simplifier.builds.digests import Digests
from simplifier.builds.dispatch import made_by, made_here
from simplifier.builds.examine import Examined, examine, gone, judged
from simplifier.builds.exclusive import exclusive
from simplifier.builds.finding import Finding, State
from simplifier.builds.making import Job, Made, Maker, Target
from simplifier.builds.record import Entry, Record, RecordKeeper, record_path
from simplifier.builds.requirements import shortfalls
from simplifier.builds.staleness import chosen_options
from simplifier.errors import OutputError
from simplifier.io.atomic import make_folder, remove_drafts, write_all_whole
from simplifier.progress import Cancel

Tell = Callable[[int, int], None]
"""Told how many of the assets that are to be made are done, and how many they are."""

_ABANDONED = 60.0  # seconds after which nobody writes a draft any more


def build(
    path: Path,
    cancel: Cancel,
    *,
    maker: Maker | None = None,
    at_once: int | None = None,
    before: Record | None = None,
    digests: Digests | None = None,
    skipped: Collection[str] = (),
    tidy: bool = True,
    tell: Tell = lambda done, total: None,
) -> list[Finding]:
    """Make what is stale, in processes of this machine or by ``maker``.

    ``at_once``  assets under way.
    ``before``   the record whose recall counts as what was; by default none is compared with.
    ``skipped``  assets that are left stale.
    ``tidy``     whether what was made of assets that are there no more is removed, unless somebody
                 changed it.

    Each asset is written whole and then recorded, so that a run that ends in whatever way goes on
    from there.  One that fails costs no other.  Once ``cancel`` is set what is under way is lost
    and the rest is left stale.

    Raises :class:`~simplifier.errors.ManifestError` for a bad manifest or record, and
    :class:`OutputError` where another build runs or the record cannot be written.
    """
    with exclusive(path.resolve().parent):
        seen = examine(path, digests or Digests())
        keeper = RecordKeeper(record_path(path), seen.record)
        was = before or {}
        findings = {one.name: judged(one, seen.record, seen.stale.get(one.name, ""), was)
                    for one in seen.assets}  # fmt: skip
        due = [one for one in seen.assets if one.name in seen.stale and one.name not in skipped]
        try:
            if due:
                for finding in _built(seen, due, keeper, was, maker, at_once, tell, cancel):
                    findings[finding.asset] = finding
            if tidy and not cancel.is_set():
                _remove_gone(seen, keeper)
        finally:
            keeper.save()
    return [*findings.values(), *(() if tidy else gone(seen))]


def _built(
    seen: Examined,
    due: Sequence[Asset],
    keeper: RecordKeeper,
    before: Record,
    maker: Maker | None,
    at_once: int | None,
    tell: Tell,
    cancel: Cancel,
) -> Iterator[Finding]:
    """One of each asset that is over, in any order."""
    folder = seen.manifest.folder
    _remove_abandoned(folder, due)
    with tempfile.TemporaryDirectory(prefix="occluder-") as scratch:
        jobs = [_job(folder, asset, Path(scratch, str(i))) for i, asset in enumerate(due)]
        if maker is None:
            outcomes = made_here(jobs, at_once, cancel)
        else:
            outcomes = made_by(maker, jobs, at_once, cancel)
        tell(0, len(due))
        with closing(outcomes):
            for done, outcome in enumerate(outcomes, start=1):
                asset, made = due[outcome.job], outcome.answer.result
                stale = Finding(asset.name, State.STALE, seen.stale[asset.name])
                if not isinstance(made, Made) and cancel.is_set():
                    continue
                if not isinstance(made, Made):
                    yield replace(stale, state=State.FAILED, why=outcome.answer.failure)
                else:
                    yield _taken(folder, asset, jobs[outcome.job], made, stale, keeper, before)
                tell(done, len(due))


def _job(folder: Path, asset: Asset, scratch: Path) -> Job:
    """Each output in a folder of its own: what appears there goes to the output's."""
    targets = (
        Target(scratch / str(i) / Path(output.file).name, folder / output.file, output)
        for i, output in enumerate(asset.outputs)
    )
    return Job(folder / asset.name, asset.options, tuple(targets))


def _taken(
    folder: Path,
    asset: Asset,
    job: Job,
    made: Made,
    stale: Finding,
    keeper: RecordKeeper,
    before: Record,
) -> Finding:
    """Move what was made to where it belongs, and record it."""
    files = {
        posixpath.join(posixpath.dirname(output), file.name): file.read_bytes()
        for output, target in zip(asset.files, job.targets, strict=True)
        for file in sorted(target.draft.parent.iterdir())
    }
    try:
        for output in asset.files:
            make_folder((folder / output).parent)
        write_all_whole({folder / name: data for name, data in files.items()})
    except OutputError as error:
        return replace(stale, state=State.FAILED, why=str(error))
    hashes = {name: sha256(data).hexdigest() for name, data in files.items()}
    old = keeper.entry(asset.name)
    keeper.put(
        asset.name,
        Entry(
            made.mesh, made.beside, chosen_options(asset.options), made.version, hashes,
            made.figures, {one.file: one.written for one in asset.outputs if one.written},
        ),
    )  # fmt: skip
    if old is not None:
        _remove(folder, old, [name for name in old.outputs if name not in hashes])
    was = before.get(asset.name)
    short = shortfalls(asset.requirements, made.figures, was.figures if was else None)
    return replace(
        stale, state=State.BUILT, figures=made.figures, short=tuple(short), warnings=made.warnings,
        seconds=made.seconds,
    )  # fmt: skip


def _remove_gone(seen: Examined, keeper: RecordKeeper) -> None:
    """What was made of meshes that are there no more, and their entries."""
    for name in seen.record.keys() - {asset.name for asset in seen.assets}:
        _remove(seen.manifest.folder, seen.record[name], list(seen.leftovers(name)))
        keeper.drop(name)


def _remove(folder: Path, entry: Entry, files: Sequence[str]) -> None:
    """Of some files of an entry those that are as they were made."""
    digests = Digests()
    for file in files:
        if digests.of(folder / file) == entry.outputs[file]:
            with suppress(OSError):
                (folder / file).unlink()


def _remove_abandoned(folder: Path, due: Sequence[Asset]) -> None:
    """Drafts that killed runs left; one that another program is just writing stays."""
    for place in {(folder / output).parent for asset in due for output in asset.files}:
        remove_drafts(place, idle=_ABANDONED)
