"""Data folders with jobs in them, as a server would have left them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

from service.jobs.asset import Thresholds
from service.jobs.job import OVERRIDES_FILE, Failure, Job, JobFile, JobKind, Submission
from service.jobs.media_types import media_type_of
from service.schemas.job_options import option_tables
from service.schemas.options import OptionTable
from service.storage.asset_store import SqlAssetStore
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.data_folder import DataFolder
from service.storage.job_store import SqlJobStore
from service.storage.sqlite import SqliteDatabase
from simplifier import __version__
from tests.service.dashboard.results import JobResult

TENANT = "local"


@dataclass
class Stock:
    """A data folder that no server has open."""

    jobs: SqlJobStore
    assets: SqlAssetStore
    blobs: FileBlobs
    tables: Mapping[JobKind, OptionTable]

    def run(
        self,
        result: JobResult,
        *,
        asset: str | None = None,
        overrides: bytes | None = None,
        **summary: Any,
    ) -> Job:
        """A job that has made this; members of its summary can be others."""
        with self.blobs.keeping() as keeping:
            paths = sorted(path for path in result.folder.rglob("*") if path.is_file())
            files = []
            for path in paths:
                name = path.relative_to(result.folder).as_posix()
                with path.open("rb") as source:
                    files.append(JobFile(name, keeping.put(source), media_type_of(name)))
            job = self._submit(result, asset, overrides)
            claim = self.jobs.claim("stock", 60.0)
            assert claim is not None
            assert claim.job.id == job.id
            assert self.jobs.succeed(claim, files, replace(result.summary, **summary))
        return self.jobs.job(TENANT, job.id)

    def failure(self, result: JobResult, failure: Failure) -> Job:
        """A job of the same mesh that has failed."""
        job = self._submit(result, None)
        claim = self.jobs.claim("stock", 60.0)
        assert claim is not None
        self.jobs.fail(claim, failure, final=True)
        return self.jobs.job(TENANT, job.id)

    def demand(self, asset: str, thresholds: Thresholds) -> str:
        """The asset's id; it is made where it is not there."""
        return self.assets.put(TENANT, asset, thresholds)[0].id

    def _submit(self, result: JobResult, asset: str | None, overrides: bytes | None = None) -> Job:
        resolved = self.tables[result.kind].read(result.options)
        with self.blobs.keeping() as keeping, result.input.open("rb") as source:
            name = f"input/{result.part}{result.input.suffix}"
            inputs = [JobFile(name, keeping.put(source), media_type_of(name), is_input=True)]
            if overrides is not None:
                decided = keeping.put(BytesIO(overrides))
                name = "castle.overrides.toml"
                inputs.append(
                    JobFile(OVERRIDES_FILE, decided, "application/toml", is_input=True, label=name)
                )
            job, _ = self.jobs.submit(
                Submission(
                    tenant=TENANT, kind=result.kind, name=result.input.name, options=resolved,
                    inputs=tuple(inputs), version=__version__, asset=asset, may_reuse=False,
                    keep=result.keep,
                ),
                queue_limit=1000,
            )  # fmt: skip
        return job


@contextmanager
def stocked(folder: Path) -> Iterator[Stock]:
    """The folder, for as long as the block lasts."""
    place = DataFolder(folder)
    place.make()
    database = SqliteDatabase.open(place.database)
    try:
        yield Stock(
            SqlJobStore(database),
            SqlAssetStore(database),
            FileBlobs(place.blobs, min_free=0),
            option_tables(1800.0, 4e9),
        )
    finally:
        database.close()
