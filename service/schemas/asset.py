"""Assets on the wire, and their runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from service.jobs.asset import LONGEST_NAME, Asset, Thresholds, asset_name, folder_path
from service.jobs.job import Job, JobFile, inputs_by_part
from service.schemas.job import JobBody, SummaryBody, moment

Name = Annotated[
    str, StringConstraints(min_length=1, max_length=LONGEST_NAME), AfterValidator(asset_name)
]
Folder = Annotated[str, StringConstraints(max_length=LONGEST_NAME), AfterValidator(folder_path)]
Share = Annotated[float, Field(ge=0, le=1)]


class ThresholdsBody(BaseModel):
    """What is demanded of each run; null demands nothing."""

    model_config = ConfigDict(extra="forbid", strict=True)

    min_precision: Share | None = None
    min_recall: Share | None = None
    max_overhang: Share | None = Field(None, description="In the mean over all views.")

    @property
    def demands(self) -> Thresholds:
        return Thresholds(self.min_precision, self.min_recall, self.max_overhang)

    @classmethod
    def of(cls, thresholds: Thresholds) -> Self:
        return cls(**asdict(thresholds))


class NewAsset(ThresholdsBody):
    """An asset to be made, or what is to be demanded of it from now on."""

    name: Name = Field(
        description="Any text that can be seen, without spaces around it; slashes are welcome.",
        examples=["props/castle"],
    )


class FolderThresholds(ThresholdsBody):
    """What is demanded of all assets in a folder that do not set it themselves."""

    folder: Folder = Field(
        description="Its path, without slashes around it; empty for all assets.",
        examples=["props/medieval"],
    )

    @classmethod
    def at(cls, folder: str, thresholds: Thresholds) -> Self:
        return cls(folder=folder, **asdict(thresholds))


class FolderThresholdsList(BaseModel):
    """By path; folders without any are not listed."""

    items: list[FolderThresholds]


class NewName(BaseModel):
    """Another name."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: Name = Field(examples=["props/gate"])


class AssetLinks(BaseModel):
    """Where to go on from an asset."""

    self: str
    runs: str
    thresholds: str
    compare: str
    jobs: str


class AssetBody(BaseModel):
    """A name and its runs: jobs that succeeded."""

    id: str
    name: str = Field(examples=["props/castle"])
    created: datetime
    runs: int = Field(ge=0, description="How many.")
    thresholds: ThresholdsBody = Field(description="Its own.")
    demanded: ThresholdsBody = Field(
        description="What counts: its own thresholds, and for each that is null that of the "
        "nearest folder which sets it."
    )
    holds: bool | None = Field(
        description="Whether the latest run is good enough; null without a run or a threshold."
    )
    latest: JobBody | None = Field(description="The latest run.")
    links: AssetLinks

    @classmethod
    def of(cls, asset: Asset, *, whole_webhook: bool) -> Self:
        """``whole_webhook`` as :meth:`JobBody.of` has it."""
        latest = asset.latest
        place = f"/v1/assets/{asset.id}"
        return cls(
            id=asset.id,
            name=asset.name,
            created=moment(asset.created),
            runs=asset.runs,
            thresholds=ThresholdsBody.of(asset.thresholds),
            demanded=ThresholdsBody.of(asset.demanded),
            holds=_holds(asset.demanded, latest),
            latest=JobBody.of(latest, whole_webhook=whole_webhook) if latest else None,
            links=AssetLinks(
                self=place,
                runs=f"{place}/runs",
                thresholds=f"{place}/thresholds",
                compare=f"{place}/compare",
                jobs=f"/v1/jobs?asset={asset.id}",
            ),
        )


class AssetPageBody(BaseModel):
    """Assets by name."""

    items: list[AssetBody]
    next: str | None = Field(description="Where the next page is; null on the last.")


class Run(BaseModel):
    """One run of an asset."""

    job_id: str
    created: datetime
    version: str
    options: dict[str, Any]
    summary: SummaryBody | None
    holds: bool | None = Field(description="By the thresholds of today; null without any.")

    @classmethod
    def of(cls, job: Job, thresholds: Thresholds) -> Self:
        return cls(
            job_id=job.id,
            created=moment(job.created),
            version=job.version,
            options=dict(job.options),
            summary=SummaryBody.of(job.summary) if job.summary else None,
            holds=_holds(thresholds, job),
        )


class RunPageBody(BaseModel):
    """Runs of an asset, newest first."""

    items: list[Run]
    next: str | None = Field(description="Where the next page is; null on the last.")


class Comparison(BaseModel):
    """What changed from one run to another."""

    a: Run
    b: Run
    change: dict[str, float | None] = Field(
        description="Of each number of the summary, b less a; null where either has none.",
        examples=[{"precision": 0.0004, "recall": 0.021, "triangles": 0, "seconds": -0.4}],
    )
    options_changed: dict[str, tuple[Any, Any]] = Field(
        description="Options that differ, as they are in a and in b.",
        examples=[{"preset": ["balanced", "best"]}],
    )

    inputs_changed: dict[str, tuple[str | None, str | None]] = Field(
        description="Files sent that differ, by part: the SHA-256 of each; null without one.",
        examples=[
            {
                "overrides": [
                    None,
                    "41a846c658ea760908b2799586c6a34cd344593abacbeb53814e98a49cf266bc",
                ]
            }
        ],
    )

    @classmethod
    def of(
        cls, a: Run, b: Run, inputs_of_a: Iterable[JobFile], inputs_of_b: Iterable[JobFile]
    ) -> Self:
        return cls(
            a=a,
            b=b,
            change=_change(a, b),
            options_changed=_differing(a.options, b.options),
            inputs_changed=_differing(_digests(inputs_of_a), _digests(inputs_of_b)),
        )


_COMPARED = (
    "triangles", "input_triangles", "levels", "seconds", "precision", "recall", "worst_recall",
    "overhang", "error_bound",
)  # fmt: skip


def _change(a: Run, b: Run) -> dict[str, float | None]:
    pairs = {name: (getattr(a.summary, name, None), getattr(b.summary, name, None))
             for name in _COMPARED}  # fmt: skip
    return {
        name: None if before is None or after is None else after - before
        for name, (before, after) in pairs.items()
    }


def _digests(files: Iterable[JobFile]) -> dict[str, str]:
    return {part: file.blob.digest for part, file in inputs_by_part(files).items()}


def _differing(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    return {
        name: (a.get(name), b.get(name)) for name in sorted({*a, *b}) if a.get(name) != b.get(name)
    }


def _holds(thresholds: Thresholds, job: Job | None) -> bool | None:
    return thresholds.held_by(job.summary) if job and job.summary else None
