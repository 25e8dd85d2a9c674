"""Results on the wire: what a job has made, and where each file is."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, Self
from urllib.parse import quote

from pydantic import BaseModel, Field

from service.jobs.job import JobFile
from service.jobs.on_demand import PAGES, has_pages, level_of, on_demand
from service.schemas.job import JobBody
from simplifier import VerdictWord


def names_of(files: Iterable[JobFile]) -> Collection[str]:
    return {file.name for file in files}


def _link(job_id: str, name: str) -> str:
    return f"/v1/jobs/{job_id}/files/{quote(name)}"


def zip_link(job_id: str) -> str:
    """Address of all results of a job at once."""
    return f"/v1/jobs/{job_id}/files.zip"


class ResultFile(BaseModel):
    """A file of a job."""

    name: str = Field(examples=["lod0.glb"])
    media_type: str = Field(examples=["model/gltf-binary"])
    size: int = Field(ge=0, description="Bytes.")
    sha256: str = Field(description="Of its bytes, in hex; also its ETag.")
    link: str = Field(examples=["/v1/jobs/j_7Qk2/files/lod0.glb"])

    @classmethod
    def of(cls, job_id: str, file: JobFile) -> Self:
        return cls(
            name=file.name,
            media_type=file.media_type,
            size=file.blob.size,
            sha256=file.blob.digest,
            link=_link(job_id, file.name),
        )


class LaterFile(BaseModel):
    """A file that is made when it is first asked for, which takes a second or a few."""

    name: str = Field(examples=["report.html"])
    link: str = Field(examples=["/v1/jobs/j_7Qk2/files/report.html"])

    @classmethod
    def of(cls, job_id: str, name: str) -> Self:
        return cls(name=name, link=_link(job_id, name))


_ON_DEMAND = Field(
    description="What is made as soon as it is asked for, and then among the files: pages of the "
    "report, and where a job keeps little its levels in all formats."
)


class FilePage(BaseModel):
    """All files of a job, by name."""

    items: list[ResultFile]
    on_demand: list[LaterFile] = _ON_DEMAND


class Level(BaseModel):
    """One level of detail."""

    level: int = Field(ge=0, description="From 0, the finest.")
    triangles: int
    precision: float | None = Field(description="Of what is hidden, the share rightly so, 0 to 1.")
    recall: float | None = Field(description="Of what could be hidden, the share that is, 0 to 1.")
    overhang: float | None = Field(
        description="Covered beside the mesh, as a share of its silhouette."
    )
    verdict: VerdictWord | None = Field(description="Whether it is good for an engine.")
    error_bound: float | None = Field(description="In the mesh's units.")
    switch_distance: float | None = Field(
        description="From how far it may be used, in the mesh's units; null for a single level."
    )
    files: dict[str, str] = Field(
        description="Where it is, by suffix.", examples=[{"glb": "/v1/jobs/j_7Qk2/files/lod0.glb"}]
    )


class Result(BaseModel):
    """What a job has made."""

    job: JobBody
    report: dict[str, Any] | None = Field(
        description="The whole report, as `docs/report.schema.json` says; of visible sets, what "
        "`occluder pvs --report` writes; null for a scene."
    )
    levels: list[Level] = Field(description="Finest first; none for a scene or visible sets.")
    files: list[ResultFile] = Field(description="All results, and what was sent.")
    on_demand: list[LaterFile] = _ON_DEMAND
    pages: dict[str, str] = Field(
        description="What shows the report to people, by what it shows: drawn when it is first "
        "asked for, and among `files` from then on.",
        examples=[{"report": "/v1/jobs/j_7Qk2/files/report.html"}],
    )

    @classmethod
    def of(cls, job: JobBody, report: dict[str, Any] | None, files: Sequence[JobFile]) -> Self:
        names = names_of(files)
        later = on_demand(job, names)
        return cls(
            job=job,
            report=report,
            levels=_levels(job.id, report or {}, (*names, *later)),
            files=[ResultFile.of(job.id, file) for file in files],
            on_demand=[LaterFile.of(job.id, name) for name in later],
            pages={shown: _link(job.id, name) for shown, name in PAGES.items()}
            if has_pages(job, names)
            else {},
        )


def _levels(job_id: str, report: Mapping[str, Any], names: Iterable[str]) -> list[Level]:
    """What the report says of each level that has files."""
    links: dict[int, dict[str, str]] = {}
    for name in sorted(names):
        if (one := level_of(name)) is not None:
            level, suffix = one
            links.setdefault(level, {})[suffix[1:]] = _link(job_id, name)
    # A single occluder is reported as a whole, levels of detail in a row each.
    rows = report.get("levels") or [report]
    return [
        Level(
            level=number,
            triangles=rows[number]["triangles"],
            precision=rows[number]["precision"],
            recall=rows[number]["recall"],
            # A report of an older version has neither.
            overhang=rows[number].get("overhang", {}).get("share"),
            verdict=rows[number].get("verdict", {}).get("word"),
            error_bound=rows[number]["error_bound"],
            switch_distance=rows[number].get("switch_distance"),
            files=links[number],
        )
        for number in sorted(links)
    ]
