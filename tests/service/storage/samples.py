"""Small values for tests of the stores."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

from service.jobs.job import Blob, Failure, JobFile, JobKind, Submission, Summary

DIED = Failure("process-died", "the process ended by signal 9", "submit it again")

FULL = Failure("disk-full", "there is no room for the result", "free some space")


@dataclass
class Clock:
    """A clock that shows what it is set to."""

    now: float = 1_700_000_000.0

    def __call__(self) -> float:
        return self.now


def blob(text: str) -> Blob:
    return Blob(hashlib.sha256(text.encode()).hexdigest(), len(text))


def mesh(text: str = "a cube") -> JobFile:
    return JobFile("input/mesh.obj", blob(text), "model/obj", is_input=True, label="cube.obj")


def results(text: str = "a result") -> list[JobFile]:
    return [
        JobFile("lod0.glb", blob(text), "model/gltf-binary"),
        JobFile("report.json", blob(f"{text}'s report"), "application/json"),
    ]


def summary(recall: float = 0.9) -> Summary:
    return Summary(
        triangles=64,
        input_triangles=5000,
        levels=3,
        seconds=1.5,
        precision=0.999,
        recall=recall,
        timings={"voxelize": 0.25, "refine": 1.0},
        warnings=("the mesh is open",),
    )


def submission(text: str = "a cube", **changes: Any) -> Submission:
    """A request for an occluder of a mesh of some content."""
    fields: dict[str, Any] = {
        "tenant": "studio",
        "kind": JobKind.OCCLUDER,
        "name": "cube.obj",
        "options": {"budget": 64},
        "inputs": (mesh(text),),
        "version": "1.0",
    }
    return Submission(**(fields | changes))
