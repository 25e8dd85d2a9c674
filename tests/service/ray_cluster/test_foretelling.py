"""Memory by sizes, against what the library foretells of the mesh itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import simplifier
from examples.castle import castle
from service.jobs.job import Blob, Job, JobFile, JobKind, JobState
from service.ray_cluster.foretelling import foretold_memory
from service.settings import Settings

_MIB = 1 << 20


def job(kind: JobKind = JobKind.OCCLUDER, **options: Any) -> Job:
    return Job(
        id="1", number=1, tenant="studio", kind=kind, name="mesh.ply", options=options,
        version="1.0", state=JobState.QUEUED, attempt=0, created=0.0,
    )  # fmt: skip


def mesh(size: int, name: str = "input/mesh.ply") -> JobFile:
    return JobFile(name, Blob("0" * 64, size), "model/ply", is_input=True)


@pytest.mark.parametrize("resolution", [64, 128, 256])
def test_no_less_than_the_library_foretells_and_not_many_times_that(
    tmp_path: Path, resolution: int
) -> None:
    file = tmp_path / "castle.glb"
    made = castle()
    simplifier.save(simplifier.Occluder(made.vertices, made.faces), file)
    needed = simplifier.estimate_memory(
        made, simplifier.SimplifyOptions(resolution=resolution)
    ).peak
    found = foretold_memory(
        job(resolution=resolution), [mesh(file.stat().st_size)], Settings(job_memory=4096 * _MIB)
    )
    assert needed <= found <= 4 * needed


def test_never_more_than_the_job_may_use() -> None:
    settings = Settings(job_memory=1024 * _MIB)
    most = foretold_memory(job(), [mesh(10**10)], settings)
    assert most == foretold_memory(job(JobKind.SCENE), [mesh(1)], settings)
    assert most == foretold_memory(job(), [mesh(1, "input/mesh.3mf")], settings)
    assert foretold_memory(job(memory_limit=0.5), [mesh(10**10)], settings) == most - 512 * _MIB
