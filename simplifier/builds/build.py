"""Manifest to current outputs: what is stale is made, and recorded as soon as it is there.

Many assets made at a time: by processes of this machine, or by a maker that is asked.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from hashlib import sha256
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import BoundedSemaphore

from simplifier.builds.asset_plan import Asset
from simplifier.builds.digests import Digests
from simplifier.builds.finding import Finding, State, shortfalls
from simplifier.builds.holding import shard_build, whole_build
from simplifier.builds.making import (
    AssetJob,
    MadeAsset,
    Maker,
    Target,
    make_asset,
    make_here,
    put_in_place,
)
from simplifier.builds.record import Entry, Record, RecordKeeper, record_path
from simplifier.builds.removal import remove_gone, remove_replaced
from simplifier.builds.shard_record import (
    ShardKeeper,
    check_other_shards,
    read_shard_record,
    shard_path,
)
from simplifier.builds.shards import Shard
from simplifier.builds.staleness import (
    Examined,
    chosen_options,
    examine_shard,
    find_gone,
    judge_unmade,
)
from simplifier.errors import OutputError
from simplifier.io.files import remove_drafts
from simplifier.io.places import followed, is_there
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
    shard: Shard | None = None,
    tidy: bool = True,
    tell: TellCount = lambda done, total: None,
) -> list[Finding]:
    """Make what is stale, in processes of this machine or by ``maker``.

    ``at_once``  assets under way.
    ``before``   the record whose recall counts as what was; by default none is compared with.
    ``skipped``  assets that are left stale.
    ``shard``    whose assets alone are made; what they come to goes to a record of the shard's own,
                 and what is gone is left to the join of all.
    ``tidy``     whether what was made of assets that are there no more is removed, unless somebody
                 changed it.

    Each asset is written whole and then recorded, so that a run that ends in whatever way goes on
    from there.  One that fails costs no other.  Once ``cancel`` is set what is under way is lost
    and the rest is left stale.

    Raises :class:`~simplifier.errors.ManifestError` for a bad manifest or record, and
    :class:`OutputError` where another build runs or the record cannot be written.
    """
    folder = followed(path).parent
    with whole_build(folder) if shard is None else shard_build(folder, shard):
        if shard is not None:
            check_other_shards(path, shard)
        seen = examine_shard(path, shard, digests or Digests())
        keeper = _keeper(path, seen, shard)
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
            if isinstance(keeper, ShardKeeper):
                if not cancel.is_set():
                    keeper.finish()
            elif tidy and not cancel.is_set():
                for name in remove_gone(seen):
                    keeper.drop(name)
        finally:
            keeper.save()
    return [*findings.values(), *(() if tidy or shard else find_gone(seen))]


def _keeper(path: Path, seen: Examined, shard: Shard | None) -> RecordKeeper:
    """Of a shard it has what its earlier run made and is current still."""
    if shard is None:
        return RecordKeeper(record_path(path), seen.record)
    own = {one.name: seen.record[one.name] for one in seen.assets if one.name in seen.record}
    place = shard_path(path, shard)
    made = read_shard_record(place).made if is_there(place) else {}
    kept = {name: one for name, one in made.items() if name in own and name not in seen.stale}
    return ShardKeeper(path, shard, own, kept)


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
                    finding = replace(stale, state=State.FAILED, why=outcome.answer.failure)
                else:
                    finding = _put_in_place(
                        seen, asset, jobs[outcome.job], made, stale, keeper, before
                    )
                if finding.state is State.FAILED:
                    keeper.note(finding)
                yield finding
                tell(done, len(due))


def _job(folder: Path, asset: Asset, scratch: Path) -> AssetJob:
    """Each output in a folder of its own: what appears there goes to the output's."""
    targets = (
        Target(scratch / str(i) / Path(output.file).name, folder / output.file, output)
        for i, output in enumerate(asset.outputs)
    )
    return AssetJob(folder / asset.name, asset.options, tuple(targets))


def _put_in_place(
    seen: Examined,
    asset: Asset,
    job: AssetJob,
    made: MadeAsset,
    stale: Finding,
    keeper: RecordKeeper,
    before: Record,
) -> Finding:
    """Move what was made to where it belongs, and record it."""
    folder = seen.manifest.folder
    try:
        files = put_in_place(job)
    except OutputError as error:
        return replace(stale, state=State.FAILED, why=str(error))
    was = before.get(asset.name)
    short = shortfalls(asset.requirements, made.figures, was.figures if was else None)
    built = replace(
        stale, state=State.BUILT, figures=made.figures, short=tuple(short), warnings=made.warnings,
        seconds=made.seconds,
    )  # fmt: skip
    hashes = {
        file.relative_to(folder).as_posix(): sha256(data).hexdigest()
        for file, data in files.items()
    }
    old = keeper.entry(asset.name)
    keeper.note(built)
    keeper.put(
        asset.name,
        Entry(
            made.mesh, made.beside, chosen_options(asset.options), made.version, hashes,
            made.figures, {one.file: one.written for one in asset.outputs if one.written},
        ),
    )  # fmt: skip
    if old is not None:
        remove_replaced(seen, asset.name, old, hashes)
    return built


def _remove_abandoned(folder: Path, due: Sequence[Asset]) -> None:
    """Drafts that killed runs left; one that another program is just writing stays."""
    for place in {(folder / output).parent for asset in due for output in asset.files}:
        remove_drafts(place, idle=_ABANDONED)


_ASKED = 256  # of a service at a time, where nothing else is said: most of them wait their turn
_READ = 8  # meshes at a time that are hashed for it, each in memory
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
    work = partial(make_asset, maker, reading=BoundedSemaphore(_READ))
    most, places, over = (
        at_once or _ASKED,
        iter(range(len(jobs))),
        SimpleQueue[Future[JobOutcome]](),
    )
    with ThreadPoolExecutor(most) as pool:

        def begin(count: int) -> int:
            """Of as many as are left; a future each of a million jobs would take memory."""
            begun = list(islice(places, count))
            for place in begun:
                pool.submit(_outcome, work, place, jobs[place]).add_done_callback(over.put)
            return len(begun)

        try:
            under_way = begin(most)
            while under_way and not cancel.is_set():
                with suppress(Empty):
                    outcome = over.get(timeout=_GLANCE).result()
                    under_way += begin(1) - 1
                    yield outcome
        finally:
            pool.shutdown(cancel_futures=True)


def _outcome(work: JobFunction, place: int, job: AssetJob) -> JobOutcome:
    return JobOutcome(place, answer_of(work, job))


def _start(threads: int) -> JobFunction:
    """What a process does with a job, on so many threads."""
    os.environ["OCCLUDER_THREADS"] = str(threads)
    return partial(make_asset, make_here)
