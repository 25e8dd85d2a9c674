"""The client: a method for each thing that the API does."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx

from service.client.errors import ClientError
from service.client.transfers import ReportShare, Upload
from service.client.values import (
    RemoteAsset,
    RemoteDelivery,
    RemoteJob,
    RemoteResult,
    asset_of,
    delivery_of,
    job_of,
    progress_of,
    result_of,
)
from service.client.wire import Wire
from service.jobs.asset import Thresholds
from service.jobs.deliveries import DeliveryState
from service.jobs.job import JobKind, JobState, Priority
from service.keep import Keep

_GLANCE = 1.0  # seconds between two questions where events do not come

Options = Mapping[str, Any]
"""By the names of ``simplifier.simplify``; what is left out has its default."""


def _report_to_nobody(share: float) -> None:
    """Stands in for a listener where nobody follows the upload."""


class Client:
    """The client of one service, safe to use from any thread.

    ``server``    its address, as ``http://127.0.0.1:8000``.
    ``key``       an API key, where one is needed.
    ``patience``  seconds for which an answer "later" (429, 503) is followed by another try.
    ``priority``  of the jobs that it submits: bulk where nobody waits for a single one.
    ``keep``      which files of their results are stored; None leaves it to the service.
    ``stop``      once set, from any thread, calls end soon by
                  :class:`~service.client.errors.StoppedError`.

    Requests whose connection is lost are sent again, under the same ``Idempotency-Key`` where they
    change something: so nothing is done twice.  Methods raise
    :class:`~service.client.errors.ClientError`, and OSError where a file here cannot be read or
    written.
    """

    def __init__(
        self,
        server: str,
        *,
        key: str | None = None,
        patience: float = 120.0,
        priority: Priority = Priority.INTERACTIVE,
        keep: Keep | None = None,
        stop: threading.Event | None = None,
    ) -> None:
        # The default is the server's too, and an older one knows no other.
        self._priority = None if priority is Priority.INTERACTIVE else priority
        self._keep = keep
        self._wire = Wire(server, key, patience, stop or threading.Event())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        self._wire.close()

    # Work.

    def submit(
        self,
        mesh: Path | bytes,
        *,
        name: str | None = None,
        options: Options | None = None,
        asset: str | None = None,
        webhook: str | None = None,
        overrides: Path | None = None,
        tell: ReportShare = _report_to_nobody,
    ) -> RemoteJob:
        """Have occluders made of a mesh; ``name`` says the format of bytes by its suffix.

        ``overrides``  a file of what was decided about the mesh; none is looked for beside it.

        The job has succeeded already where the same work was done before.
        """
        upload = Upload.of(mesh, name)
        if overrides is not None:
            uploads = {"mesh": upload, "overrides": _overrides(overrides)}
            fields = self._in_form(options, asset, webhook)
            return _job_in(self._wire.post_parts("/v1/occluders", uploads, fields, tell))
        return self._body_job("/v1/occluders", upload, options, asset, webhook, tell)

    def submit_scene(
        self,
        scene: Path | bytes,
        *,
        name: str | None = None,
        options: Options | None = None,
        asset: str | None = None,
        webhook: str | None = None,
        tell: ReportShare = _report_to_nobody,
    ) -> RemoteJob:
        """Have a tree of occluders made of a scene: a GLB, or a zip of a folder of meshes."""
        upload = Upload.of(scene, name)
        return self._body_job("/v1/scenes", upload, options, asset, webhook, tell)

    def submit_visibility(
        self,
        scene: Path | bytes,
        *,
        name: str | None = None,
        options: Options | None = None,
        asset: str | None = None,
        webhook: str | None = None,
        tell: ReportShare = _report_to_nobody,
    ) -> RemoteJob:
        """Have it found what is visible from view cells: of a scene, or of an elevation model."""
        upload = Upload.of(scene, name)
        return self._body_job("/v1/visibility", upload, options, asset, webhook, tell)

    def evaluate(
        self,
        mesh: Path,
        occluder: Path,
        *,
        options: Options | None = None,
        asset: str | None = None,
        webhook: str | None = None,
        overrides: Path | None = None,
    ) -> RemoteJob:
        """Have an occluder judged that was made elsewhere; ``overrides`` are those of the mesh."""
        uploads = {"mesh": Upload.of(mesh), "occluder": Upload.of(occluder)}
        if overrides is not None:
            uploads["overrides"] = _overrides(overrides)
        fields = self._in_form(options, asset, webhook)
        return _job_in(self._wire.post_parts("/v1/evaluations", uploads, fields, _report_to_nobody))

    # Jobs.

    def job(self, job_id: str) -> RemoteJob:
        return job_of(self._wire.get(f"/v1/jobs/{job_id}"))

    def jobs(
        self,
        *,
        states: Sequence[JobState] = (),
        kind: JobKind | None = None,
        asset_id: str | None = None,
    ) -> Iterator[RemoteJob]:
        """The jobs that there are, newest first, asked for a page at a time."""
        wanted = {"state": states, "kind": kind, "asset": asset_id}
        return map(job_of, self._wire.items("/v1/jobs", wanted))

    def cancel(self, job_id: str) -> RemoteJob:
        """Ask for the end of a job; one that has ended stays as it is."""
        try:
            return job_of(self._wire.post(f"/v1/jobs/{job_id}/cancel"))
        except ClientError as error:
            if error.problem.status != httpx.codes.CONFLICT:
                raise
            return self.job(job_id)

    def retry(self, job_id: str) -> RemoteJob:
        """A new job that does again what failed or was cancelled."""
        return job_of(self._wire.post(f"/v1/jobs/{job_id}/retry"))

    def rerun(self, job_id: str, options: Options | None = None) -> RemoteJob:
        """A new job with the same mesh; options that are left out stay as they were.

        It has succeeded already where the same work was done before.
        """
        return job_of(self._wire.post(f"/v1/jobs/{job_id}/rerun", {"options": dict(options or {})}))

    def watch(self, job_id: str) -> Iterator[RemoteJob]:
        """The job as it is, then each time that it has changed, until it has ended.

        By server-sent events; where they do not come, or break off, it is asked now and then.
        """
        while True:
            try:
                for job in self._changes(job_id):
                    yield job
                    if job.state.ended:
                        return
            except httpx.TransportError:
                pass  # the question below says so where the server is gone for good
            job = self.job(job_id)
            yield job
            if job.state.ended:
                return
            self._wire.pause(_GLANCE)

    def wait(self, job_id: str, tell: Callable[[RemoteJob], None] = lambda job: None) -> RemoteJob:
        """The job once it has ended, in whatever way; ``tell`` hears of each change on the way."""
        for job in self.watch(job_id):
            tell(job)
        return job

    # Results.

    def result(self, job_id: str) -> RemoteResult:
        """What a job has made; refused while it has not succeeded."""
        return result_of(self._wire.get(f"/v1/jobs/{job_id}/result"))

    def download(
        self, job_id: str, target: Path, *, level: int | None = None, form: str = "glb"
    ) -> Path:
        """Fetch an occluder: a level of detail; without, all in one GLB, or else the finest."""
        whole = level is None and form == "glb"
        return self.fetch(job_id, "occluder.glb" if whole else f"lod{level or 0}.{form}", target)

    def fetch(self, job_id: str, name: str, target: Path) -> Path:
        """Fetch a file of a job by its name; it appears whole or not at all."""
        self._wire.download(f"/v1/jobs/{job_id}/files/{name}", target)
        return target

    # Webhooks.

    def deliveries(
        self, *, state: DeliveryState | None = None, job_id: str | None = None
    ) -> Iterator[RemoteDelivery]:
        """What became of webhooks, newest first, asked for a page at a time."""
        wanted = {"state": state, "job": job_id}
        return map(delivery_of, self._wire.items("/v1/deliveries", wanted))

    def redeliver(self, delivery_id: str) -> RemoteDelivery:
        """Have a webhook sent again, at once; its id stays the same."""
        return delivery_of(self._wire.post(f"/v1/deliveries/{delivery_id}/redeliver"))

    # Assets.

    def asset(self, asset_id: str) -> RemoteAsset:
        return asset_of(self._wire.get(f"/v1/assets/{asset_id}"))

    def asset_named(self, name: str) -> RemoteAsset | None:
        """That of exactly this name, if there is one."""
        return next(map(asset_of, self._wire.items("/v1/assets", {"name": name})), None)

    def assets(self, *, contains: str | None = None) -> Iterator[RemoteAsset]:
        """Assets by name, asked for a page at a time; ``contains`` is a part of the name."""
        return map(asset_of, self._wire.items("/v1/assets", {"contains": contains}))

    def runs(self, asset_id: str) -> Iterator[Mapping[str, Any]]:
        """What each run of an asset gave, newest first: ``job_id``, ``summary``, ``holds``..."""
        return self._wire.items(f"/v1/assets/{asset_id}/runs", {})

    def compare(
        self, asset_id: str, a: str | None = None, b: str | None = None
    ) -> Mapping[str, Any]:
        """What changed from run ``a`` to ``b``; by default the last two."""
        compared: Mapping[str, Any] = self._wire.get(
            f"/v1/assets/{asset_id}/compare", {"a": a, "b": b}
        )
        return compared

    def tradeoff(self, asset_id: str, options: Options | None = None) -> RemoteJob:
        """Measure speed against accuracy on the mesh of an asset's latest run.

        Options are those of ``occluder tradeoff``, by the names of ``simplifier.TradeoffOptions``.
        """
        return job_of(self._wire.post(f"/v1/assets/{asset_id}/tradeoff", dict(options or {})))

    def put_asset(self, name: str, thresholds: Thresholds) -> RemoteAsset:
        """Make an asset, or change what is demanded of it."""
        return asset_of(self._wire.put("/v1/assets", {"name": name, **asdict(thresholds)}))

    def set_thresholds(self, asset_id: str, thresholds: Thresholds) -> RemoteAsset:
        return asset_of(self._wire.put(f"/v1/assets/{asset_id}/thresholds", asdict(thresholds)))

    def remove_asset(self, asset_id: str) -> None:
        """Remove an asset with its jobs; refused while one has not ended."""
        self._wire.delete(f"/v1/assets/{asset_id}")

    def _body_job(
        self,
        path: str,
        upload: Upload,
        options: Options | None,
        asset: str | None,
        webhook: str | None,
        tell: ReportShare,
    ) -> RemoteJob:
        """The job of an upload that is all of a request's body."""
        query = {**_in_address(options), **self._labels(asset, webhook)}
        return _job_in(self._wire.post_body(path, upload, query, tell))

    def _in_form(
        self, options: Options | None, asset: str | None, webhook: str | None
    ) -> dict[str, Any]:
        """The fields of a form that go along with files."""
        text = json.dumps(dict(options)) if options else None
        return {"options": text, **self._labels(asset, webhook)}

    def _labels(self, asset: str | None, webhook: str | None) -> dict[str, Any]:
        return {
            "asset": asset, "webhook": webhook, "priority": self._priority, "keep": self._keep,
        }  # fmt: skip

    def _changes(self, job_id: str) -> Iterator[RemoteJob]:
        """The job at each event, as far as they come."""
        job: RemoteJob | None = None
        for event in self._wire.events(f"/v1/jobs/{job_id}/events"):
            if event.type == "state":
                job = job_of(json.loads(event.data))
                yield job
            elif event.type == "progress" and job is not None:
                job = replace(job, progress=progress_of(json.loads(event.data)))
                yield job


def _in_address(options: Options | None) -> dict[str, Any]:
    """Options as parameters of an address: lists are written with commas."""
    return {
        name: ",".join(map(str, value)) if isinstance(value, (list, tuple)) else value
        for name, value in (options or {}).items()
    }


def _overrides(file: Path) -> Upload:
    """An upload of overrides, known as such whatever the file is called."""
    return Upload.of(file, media_type="application/toml")


def _job_in(body: Mapping[str, Any]) -> RemoteJob:
    """The job of an answer: of a result, where that is stored already, or itself."""
    return job_of(body.get("job", body))
