"""Jobs in words: states, stages, kinds of failure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.jobs.job import Failure, JobKind, JobState

STATES: Mapping[JobState, str] = {
    JobState.QUEUED: "waiting",
    JobState.RUNNING: "running",
    JobState.SUCCEEDED: "succeeded",
    JobState.FAILED: "failed",
    JobState.CANCELLED: "cancelled",
}
STATE_CLASSES: Mapping[JobState, str] = {
    JobState.QUEUED: "quiet",
    JobState.RUNNING: "quiet",
    JobState.SUCCEEDED: "good",
    JobState.FAILED: "bad",
    JobState.CANCELLED: "doubt",
}
KINDS: Mapping[JobKind, str] = {
    JobKind.OCCLUDER: "occluder",
    JobKind.EVALUATION: "evaluation",
    JobKind.SCENE: "scene",
    JobKind.TRADEOFF: "trade-off",
    JobKind.VISIBILITY: "visible sets",
}

_STAGES = {
    "preparing": "preparing: compiling, once",
    "load": "reading the mesh",
    "voxelize": "voxelizing",
    "fill": "filling the solid",
    "surface": "meshing the voxels",
    "sections": "cutting sections",
    "loops": "tracing outlines",
    "chains": "simplifying outlines",
    "cut": "choosing polygons",
    "refine": "refining triangles",
    "write": "writing files",
    "accuracy": "measuring accuracy",
    "occluders": "making occluders",
    "runs": "running settings",
    "objects": "reading the objects",
    "sets": "finding what each cell sees",
}
_FAILURES = {
    "unreadable-mesh": "The mesh cannot be read",
    "invalid-options": "The options cannot be used",
    "invalid-overrides": "The overrides cannot be used",
    "out-of-memory": "The job needed more memory than is allowed",
    "out-of-time": "The job took longer than is allowed",
    "process-died": "The worker process ended at every attempt",
    "disk-full": "The disk is full",
    "upload-lost": "The uploaded file is no longer stored",
    "unavailable": "Something that the job needs is not installed",
    "internal-error": "The service failed unexpectedly",
}


def stage_words(stage: str) -> str:
    """What is being done."""
    return _STAGES.get(stage, stage)


def failure_title(failure: Failure) -> str:
    """What kind of failure it was."""
    return _FAILURES.get(failure.kind, failure.kind)


def sentence(text: str) -> str:
    """Text with a full stop, and a capital unless it begins with a name; empty stays empty."""
    if not text:
        return ""
    named = text.partition(" ")[0].endswith(":")
    return f"{text[0] if named else text[0].upper()}{text[1:]}."


def option_words(value: Any) -> str:
    """A value as people write it."""
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case list():
            return ", ".join(f"{one:g}" for one in value)
        case float():
            return f"{value:g}"
        case int():
            return f"{value:,}" if abs(value) < 10**9 else str(value)
        case _:
            return str(value)
