"""Files of a result that are made when somebody first asks for them, and kept from then on.

Pages and pictures of a report always: drawing them takes 0.4 s, of jobs that may take as long, and
most results of a build are never looked at.  Where a job keeps little
(:class:`~service.keep.Keep`) also its levels one by one in all formats, and the original to look
at: a million small jobs would else write twenty million files, for nobody.  Where on the mesh
recall is lost always comes on demand.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from concurrent.futures import Future
from typing import Protocol

from service.jobs.job import THUMBNAIL, Job, JobKind, JobState
from simplifier import OCCLUDER_SUFFIXES

REPORT = "report.json"
FINEST = "lod0.glb"
"""The finest level, where a job keeps all."""
EXACT = "lod0.ply"
"""The same to the last bit: a GLB rounds corners to 32 bits, and what is drawn of it may differ by
a pixel from what was measured."""
ORIGINAL = "original.glb"
WHOLE = ("occluder.glb", "occluder.occ")
"""All levels in one file."""
LEVELS = "levels.npz"
"""All levels to the last bit: where a job keeps little, what other files are written from."""
LOSS = "loss.json"
"""Where on the mesh recall is lost, for the 3D view to paint it: seconds for a large mesh."""

OCCLUDERS = "scene.zip"
"""Of a scene: its tree and each occluder by itself."""
WALK = "scene.walk"
"""Of a scene: a walk through it with what is culled in each frame, for a page to play."""

PAGES: Mapping[str, str] = {
    "report": "report.html",
    "silhouettes": "pictures/silhouettes.png",
    "recall": "pictures/recall.png",
    "precision": "pictures/precision.png",
}
"""Files by what they show; the pictures of the views are beside the last three."""

_VIEW = re.compile(r"pictures/view_[0-9]{2}_[a-z0-9_]{1,40}\.png")
_LEVEL = re.compile(r"lod(0|[1-9][0-9]*)(\.[a-z]+)")
_KINDS = (JobKind.OCCLUDER, JobKind.EVALUATION)


class _Levels(Protocol):
    @property
    def levels(self) -> int: ...


class Made(Protocol):
    """A job, or what is told of one over the wire."""

    @property
    def kind(self) -> JobKind: ...
    @property
    def state(self) -> JobState: ...
    @property
    def summary(self) -> _Levels | None: ...


def level_file(level: int, suffix: str) -> str:
    """The name of a level by itself, 0 the finest, in the format of a suffix."""
    return f"lod{level}{suffix}"


def level_of(name: str) -> tuple[int, str] | None:
    """The level and the suffix that a file name stands for; None for any other file."""
    found = _LEVEL.fullmatch(name)
    return (int(found[1]), found[2]) if found else None


def has_pages(job: Made, files: Collection[str]) -> bool:
    """Whether a job's report can be drawn, or is; ``files`` are the names of its files."""
    if job.kind not in _KINDS or job.state is not JobState.SUCCEEDED or REPORT not in files:
        return False
    # An evaluation was sent its occluder.
    return FINEST in files or LEVELS in files or job.kind is JobKind.EVALUATION


def is_page(name: str) -> bool:
    """Whether a file of this name would be drawn."""
    return name in PAGES.values() or _VIEW.fullmatch(name) is not None


def on_demand(job: Made, files: Collection[str]) -> tuple[str, ...]:
    """What is not among the ``files`` of a job, by name, and is made as soon as it is asked for.

    The pictures of single views are not told, for only drawing decides which there are.
    """
    drawn = (*PAGES.values(), LOSS) if has_pages(job, files) else ()
    made = (*_written(job, files), *drawn)
    return tuple(name for name in made if name not in files)


def can_be_made(job: Made, files: Collection[str], name: str) -> bool:
    """Whether a file that is not there may be once it is asked for."""
    if name in files or (is_page(name) and PAGES["report"] in files):
        return False
    return (is_page(name) and has_pages(job, files)) or name in on_demand(job, files)


def made_of(name: str) -> Collection[str]:
    """The names of the results that a file is made of, as far as they are there."""
    if name == ORIGINAL:
        return ()
    if name == WALK:
        return (OCCLUDERS,)
    if is_page(name) or name == LOSS:
        return (REPORT, LEVELS, EXACT)
    return (LEVELS,)


def needs_uploads(job: Made, name: str) -> bool:
    """Whether what was sent is needed to make a file."""
    return is_page(name) or name in (ORIGINAL, WALK, LOSS) or job.kind is JobKind.EVALUATION


def _written(job: Made, files: Collection[str]) -> Iterator[str]:
    if job.state is not JobState.SUCCEEDED or job.summary is None:
        return
    if job.kind is JobKind.SCENE and OCCLUDERS in files:
        yield WALK
    if REPORT not in files:
        return
    if job.kind is JobKind.EVALUATION:
        yield FINEST
        yield ORIGINAL
    if job.kind is JobKind.OCCLUDER and LEVELS in files:
        for level in range(job.summary.levels):
            for suffix in OCCLUDER_SUFFIXES:
                yield level_file(level, suffix)
        yield from WHOLE
        yield ORIGINAL


def carried_away(names: Collection[str]) -> tuple[str, ...]:
    """Of the names of results those that are of use elsewhere, in order.

    The others serve pages of the service, or the making of further files.
    """
    return tuple(sorted(set(names) - {ORIGINAL, LOSS, LEVELS, THUMBNAIL}))


class FileMaker(Protocol):
    """Makes files of jobs on demand."""

    def make(self, job: Job, name: str) -> Future[None]:
        """Done once it is a file of the job, whoever asked first; of pages, once all of them are.

        It ends by :class:`~service.errors.ServiceError` where it cannot be made, and raises
        :class:`~service.errors.NotReadyError` where too much is asked for at once.
        """
