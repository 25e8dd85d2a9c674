"""Occluders made by a service for ``occluder build --server``, the same bytes as here."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from simplifier import (
    CancelledError,
    OccluderError,
    OptionError,
    SimplifyOptions,
    __version__,
)
from simplifier.cli.plugin import overrides_beside

if TYPE_CHECKING:
    from service.client import Client, RemoteJob
    from simplifier.builds.making import AssetJob

_PATIENCE = 3600.0  # seconds for which a full queue is waited for
_SENT = 8  # meshes at a time
_GLANCE = 0.1  # seconds between looks at whether to stop
_DEFAULTS = {field.name: field.default for field in SimplifyOptions.fields()}


@contextmanager
def maker(address: str, key: str | None, stop: threading.Event) -> Iterator[RemoteMaker]:
    """An entry point of the group ``occluder.makers``."""
    # Here, not above: without the client installed the message should say so.
    try:
        from service.client import Client, Priority
    except ModuleNotFoundError as error:
        raise OccluderError(
            f"the client needs '{error.name}', which is not installed",
            remedy="run: pip install 'planar-occluder[service]'",
        ) from error
    with (
        Client(address, key=key, patience=_PATIENCE, priority=Priority.BULK, stop=stop) as client,
        Client(address, key=key, patience=0.0) as canceller,
    ):
        remote = RemoteMaker(client, canceller)
        with _cancelling(remote, stop):
            yield remote


@contextmanager
def _cancelling(remote: RemoteMaker, stop: threading.Event) -> Iterator[None]:
    """Cancel what is under way once ``stop`` is set: whoever follows a job hears of it then, and
    otherwise only when the server next says that it is still there."""
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_GLANCE):
            if stop.is_set():
                remote.cancel()
                return

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()


class RemoteMaker:
    """Makes a mesh's occluder on the other machine; to be called from any thread.

    However many call it, few send at a time: the first jobs begin while others are sent, and where
    the queue is full few come back to ask.
    """

    def __init__(self, client: Client, canceller: Client) -> None:
        self._client, self._canceller = client, canceller
        self._sending = threading.BoundedSemaphore(_SENT)
        self._under_way: set[str] = set()

    def cancel(self) -> None:
        """All that is under way."""
        for job_id in tuple(self._under_way):
            self._cancel(job_id)

    def __call__(self, job: AssetJob) -> Mapping[str, Any]:
        """Write the drafts; the report.

        Raises :class:`OccluderError` for whatever the service refuses and for what it would make
        otherwise than this version, and :class:`CancelledError` once the caller wants to stop: its
        job is cancelled then.
        """
        from service.client import ClientError, StoppedError

        asked = _options_to_send(job.options)
        _check_plain(job)
        try:
            by_hand = overrides_beside(job.mesh)
            with self._sending:
                sent = self._client.submit(job.mesh, overrides=by_hand, options=asked)
            done = self._wait(sent)
            report = self._client.result(done.id).report
            for target in job.targets:
                self._fetch(done.id, target.draft, job.options.levels is not None)
        except ClientError as error:
            raise OccluderError(str(error)) from error
        except StoppedError:
            raise CancelledError("cancelled") from None
        if report is None:
            raise OccluderError("the service has made no report", where=str(job.mesh))
        return report

    def _cancel(self, job_id: str) -> None:
        from service.client import ClientError

        with suppress(ClientError):  # a server that is gone has nothing to cancel
            self._canceller.cancel(job_id)

    def _wait(self, job: RemoteJob) -> RemoteJob:
        from service.client import StoppedError
        from service.jobs.job import JobState

        self._under_way.add(job.id)
        try:
            _check_version(job)
            done = job if job.state.ended else self._client.wait(job.id)
        except (StoppedError, OccluderError):
            self._cancel(job.id)
            raise
        finally:
            self._under_way.discard(job.id)
        if done.state is JobState.SUCCEEDED:
            return done
        failure = done.failure
        if failure is None:
            raise OccluderError(f"the service's job is {done.state}")
        raise OccluderError(failure.detail, remedy=failure.remedy)

    def _fetch(self, job_id: str, target: Path, leveled: bool) -> None:
        """A file as ``Product.save`` names it, or several."""
        form = target.suffix[1:].lower()
        if not leveled:
            self._client.fetch(job_id, f"lod0.{form}", target)
            return
        if form == "glb":
            self._client.fetch(job_id, "occluder.glb", target)
        for level in self._client.result(job_id).levels:
            place = target.with_name(f"{target.stem}_lod{level.level}{target.suffix}")
            self._client.fetch(job_id, f"lod{level.level}.{form}", place)


def _options_to_send(options: SimplifyOptions) -> dict[str, Any]:
    """What differs from the defaults; a single occluder is one level, which a service has to be
    told."""
    chosen = {name: one for name, one in asdict(options).items() if one != _DEFAULTS[name]}
    for name in ("slicer", "device"):
        if name in chosen:
            raise OptionError(
                "a service draws with its own", where=name, remedy="leave it out, or build here"
            )
    if options.levels is None and not options.wholly_inside:
        chosen["lods"] = 1
    return chosen


def _check_plain(job: AssetJob) -> None:
    for target in job.targets:
        for name in target.output.written:
            raise OptionError(
                f"a service writes '{target.output.file}' plainly",
                where=name.replace("_", " "),
                remedy="leave it out, or build here",
            )


def _check_version(job: RemoteJob) -> None:
    """What another version makes may differ, and would be stale here as soon as it came."""
    if job.version != __version__:
        raise OccluderError(
            f"the service runs version {job.version}, and this is {__version__}",
            where="server",
            remedy="install the same version on both, or build here",
        )
