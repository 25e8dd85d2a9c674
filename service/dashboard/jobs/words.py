"""Jobs in words: states, stages, kinds of failure."""

from __future__ import annotations

from collections.abc import Mapping

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
    "preparing": "preparing: kernels are made ready, once",
    "load": "reading the mesh",
    "voxelize": "making voxels",
    "fill": "filling the inside",
    "surface": "finding the surface",
    "sections": "cutting sections",
    "loops": "tracing outlines",
    "chains": "simplifying outlines",
    "cut": "choosing polygons",
    "refine": "refining",
    "write": "writing files",
    "accuracy": "measuring accuracy",
    "occluders": "making occluders",
    "runs": "running settings",
    "objects": "reading the objects",
    "sets": "finding what each cell sees",
}
_FAILURES = {
    "unreadable-mesh": "The mesh cannot be read",
    "invalid-options": "The options do not go together",
    "invalid-overrides": "The overrides cannot be used",
    "out-of-memory": "It needed more memory than it may",
    "out-of-time": "It took longer than it may",
    "process-died": "Its process died at every attempt",
    "disk-full": "The disk is full",
    "upload-lost": "What was sent is stored no more",
    "unavailable": "What it needs is not there",
    "internal-error": "The program failed",
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
