"""Manifest to current outputs: what is stale is made, and recorded as soon as it is there.

Many assets made at a time: by processes of this machine, or by a maker that is asked.

One build of a folder at a time.
"""

from __future__ import annotations

import os
import posixpath
import tempfile
from collections.abc import Collection, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path

from simplifier.builds.asset_plan import Asset
from simplifier.builds.finding import Finding, State, shortfalls
from simplifier.builds.making import AssetJob, MadeAsset, Maker, Target, make_asset, make_here
from simplifier.builds.record import Digests, Entry, Record, RecordKeeper, record_path
from simplifier.builds.staleness import Examined, chosen_options, examine, find_gone, judge_unmade
from simplifier.errors import OutputError
from simplifier.io.files import make_folder, remove_drafts, write_all_whole
from simplifier.kernels.threads import thread_count
from simplifier.processes import JobFunction, JobOutcome, answer_of, run_jobs
from simplifier.progress import Cancel, TellCount

_ABANDONED = 60.0  # seconds after which nobody writes a draft any more


def build_assets(
    path: Path,
    cancel: Cancel,
    *,
    maker: Maker | None = None,
    at_once: int | None = None,
    before: Record | None = None,
    digests: Digests | None = None,
    skipped: Collection[str] = (),
    tidy: bool = True,
    tell: TellCount = lambda done, total: None,
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
        findings = {one.name: judge_unmade(one, seen.record, seen.stale.get(one.name, ""), was)
                    for one in seen.assets}  # fmt: skip
        due = [one for one in seen.assets if one.name in seen.stale and one.name not in skipped]
        try:
            if due:
                for finding in _findings_of_due(
                    seen, due, keeper, was, maker, at_once, tell, cancel
                ):
                    findings[finding.asset] = finding
            if tidy and not cancel.is_set():
                _remove_gone(seen, keeper)
        finally:
            keeper.save()
    return [*findings.values(), *(() if tidy else find_gone(seen))]


def _findings_of_due(
    seen: Examined,
    due: Sequence[Asset],
    keeper: RecordKeeper,
    before: Record,
    maker: Maker | None,
    at_once: int | None,
    tell: TellCount,
    cancel: Cancel,
) -> Iterator[Finding]:
    """One of each asset that is over, in any order."""
    folder = seen.manifest.folder
    _remove_abandoned(folder, due)
    with tempfile.TemporaryDirectory(prefix="occluder-") as scratch:
        jobs = [_job(folder, asset, Path(scratch, str(i))) for i, asset in enumerate(due)]
        if maker is None:
            outcomes = answers_here(jobs, at_once, cancel)
        else:
            outcomes = answers_by(maker, jobs, at_once, cancel)
        tell(0, len(due))
        with closing(outcomes):
            for done, outcome in enumerate(outcomes, start=1):
                asset, made = due[outcome.job], outcome.answer.result
                stale = Finding(asset.name, State.STALE, seen.stale[asset.name])
                if not isinstance(made, MadeAsset) and cancel.is_set():
                    continue
                if not isinstance(made, MadeAsset):
                    yield replace(stale, state=State.FAILED, why=outcome.answer.failure)
                else:
                    yield _put_in_place(
                        folder, asset, jobs[outcome.job], made, stale, keeper, before
                    )
                tell(done, len(due))


def _job(folder: Path, asset: Asset, scratch: Path) -> AssetJob:
    """Each output in a folder of its own: what appears there goes to the output's."""
    targets = (
        Target(scratch / str(i) / Path(output.file).name, folder / output.file, output)
        for i, output in enumerate(asset.outputs)
    )
    return AssetJob(folder / asset.name, asset.options, tuple(targets))


def _put_in_place(
    folder: Path,
    asset: Asset,
    job: AssetJob,
    made: MadeAsset,
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


_ASKED = 8  # of a service at a time, where nothing else is said
_GLANCE = 0.1  # seconds between looks at whether to stop


def answers_here(
    jobs: Sequence[AssetJob], at_once: int | None, cancel: Cancel
) -> Generator[JobOutcome, None, None]:
    """What comes of each, a :class:`~simplifier.builds.making.MadeAsset`, in any order.

    ``at_once``  processes; by default as many as there are processors, which they share.  Once
    ``cancel`` is set they are ended, and what they are at is lost.
    """
    processors = thread_count()
    processes = min(at_once or processors, len(jobs))
    threads = max(1, processors // processes)
    yield from run_jobs(_start, (threads,), jobs, processes, cancel)


def answers_by(
    maker: Maker, jobs: Sequence[AssetJob], at_once: int | None, cancel: Cancel
) -> Generator[JobOutcome, None, None]:
    """As :func:`answers_here`, ``at_once`` by a maker that ends soon by itself on ``cancel``."""
    work = partial(make_asset, maker)
    with ThreadPoolExecutor(at_once or _ASKED) as pool:
        waiting: dict[Future[JobOutcome], None] = {
            pool.submit(_outcome, work, place, job): None for place, job in enumerate(jobs)
        }
        try:
            while waiting and not cancel.is_set():
                for done in wait(waiting, _GLANCE, FIRST_COMPLETED).done:
                    del waiting[done]
                    yield done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _outcome(work: JobFunction, place: int, job: AssetJob) -> JobOutcome:
    return JobOutcome(place, answer_of(work, job))


def _start(threads: int) -> JobFunction:
    """What a process does with a job, on so many threads."""
    os.environ["OCCLUDER_THREADS"] = str(threads)
    return partial(make_asset, make_here)


try:
    import fcntl
except ImportError:  # Windows: builds are not kept apart there
    fcntl = None  # type: ignore[assignment]


@contextmanager
def exclusive(folder: Path) -> Iterator[None]:
    """Hold the folder until the block ends, or the process in whatever way; it leaves no file.

    Raises :class:`OutputError` at once where another process holds it.
    """
    if fcntl is None:
        yield
        return
    try:
        held = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise OutputError(
            f"the folder cannot be opened ({error.strerror})",
            where=str(folder),
            remedy="check the path and its permissions",
        ) from None
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(
                "another build of this folder is running",
                where=str(folder),
                remedy="wait for its end, or end it",
            ) from None
        yield
    finally:
        os.close(held)
