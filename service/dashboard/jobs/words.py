"""Jobs in words: states, stages, kinds of failure, times."""

from __future__ import annotations

import time
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
}

_STAGES = {
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
}
_FAILURES = {
    "unreadable-mesh": "The mesh cannot be read",
    "invalid-options": "The options do not go together",
    "out-of-memory": "It needed more memory than it may",
    "out-of-time": "It took longer than it may",
    "process-died": "Its process died at every attempt",
    "disk-full": "The disk is full",
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
    """With a full stop, and a capital unless it begins with a name; empty stays empty."""
    if not text:
        return ""
    named = text.partition(" ")[0].endswith(":")
    return f"{text[0] if named else text[0].upper()}{text[1:]}."


def moment_words(when: float) -> str:
    """Unix seconds as date and time, UTC."""
    return time.strftime("%Y-%m-%d %H:%M", time.gmtime(when))


def seconds_words(seconds: float) -> str:
    """How long something takes."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"


def percent(share: float | None, digits: int = 1) -> str:
    """A share from 0 to 1; a dash where it is not known.  Never rounded up to 100."""
    if share is None:
        return "-"
    shown = f"{100.0 * share:.{digits}f}"
    if share < 1.0 and float(shown) >= 100.0:
        shown = f"{100.0 - 10.0**-digits:.{digits}f}"
    return f"{shown} %"


def size_words(count: int) -> str:
    """Bytes."""
    size = float(count)
    for unit in ("bytes", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.0f} {unit}" if unit == "bytes" else f"{size:.1f} {unit}"
        size /= 1000.0
    return f"{size:.1f} GB"
