"""What the server and a worker process say to each other: JSON, checked on arrival.

No pickles: a process that reads hostile meshes must not be able to run code in the server.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from service.jobs.job import Failure, JobKind, Summary
from service.jobs.progress import JobProgress
from service.keep import Keep

LARGEST = 16 << 20
"""Bytes of a message at most; a summary with ten thousand warnings has two million."""


@dataclass(frozen=True)
class Task:
    """A job as its process sees it.

    ``name``     of the upload as its owner calls it, for reports and messages.
    ``inputs``   paths by the name of the input: ``mesh``, ``occluder``, ``overrides``, ``scene``.
    ``results``  an empty folder for the files that are made.
    ``scratch``  an empty folder for whatever else is written; both go when the attempt is over.
    ``threads``  to be used; ``memory`` bytes that it may take beside what the process has.
    ``unpacked``  bytes that an archive may hold.
    ``labels``   what its owner calls an input, by the input's name, where that is known.
    ``reading``  seconds that it may take over its inputs before it begins with them; None for any.
    ``digests``  SHA-256 in hex by the input's name: what its file has to be, or nothing is done.
    ``request_id``  of the request that it is done for, for the log.
    ``keep``     which files of the result are written.
    ``pages``    whether the pages of its report are drawn now; else when somebody asks for them.
    ``journal``  a file that outlives the attempt, for what is not to be done again; None for none.
    ``wanted``   a file to be made of what an earlier job has kept, which is among the inputs.
    """

    kind: JobKind
    name: str
    options: Mapping[str, Any]
    inputs: Mapping[str, str]
    results: str
    scratch: str
    threads: int
    memory: int
    unpacked: int
    labels: Mapping[str, str] = field(default_factory=dict)
    digests: Mapping[str, str] = field(default_factory=dict)
    reading: float | None = None
    request_id: str | None = None
    keep: Keep = Keep.ALL
    pages: bool = True
    wanted: str | None = None
    journal: str | None = None
    type: Literal["task"] = "task"


@dataclass(frozen=True)
class CancelTask:
    """The task is no longer wanted."""

    type: Literal["cancel"] = "cancel"


@dataclass(frozen=True)
class Ready:
    """Everything is loaded; tasks may come.

    ``unconfined``  what the process can do though it should not, since the system has no way to
    keep it from that: "reach the network".
    """

    unconfined: tuple[str, ...] = ()
    type: Literal["ready"] = "ready"


@dataclass(frozen=True)
class TaskProgress:
    """How far the task is."""

    progress: JobProgress
    type: Literal["progress"] = "progress"


@dataclass(frozen=True)
class Done:
    """The files are in the folder of results."""

    summary: Summary
    type: Literal["done"] = "done"


@dataclass(frozen=True)
class Failed:
    """There is no result, and another try would end alike.

    ``odd``  whether the process may be the worse for it, and should be replaced.
    """

    failure: Failure
    odd: bool
    type: Literal["failed"] = "failed"


@dataclass(frozen=True)
class Damaged:
    """Nothing was done, for these inputs have other bytes than they should."""

    inputs: tuple[str, ...]
    type: Literal["damaged"] = "damaged"


@dataclass(frozen=True)
class Cancelled:
    """The task has ended because it was told to."""

    type: Literal["cancelled"] = "cancelled"


Instruction = Task | CancelTask
Answer = Ready | TaskProgress | Done | Failed | Damaged | Cancelled

_INSTRUCTIONS: TypeAdapter[Instruction] = TypeAdapter(
    Annotated[Instruction, Field(discriminator="type")]
)
_ANSWERS: TypeAdapter[Answer] = TypeAdapter(
    Annotated[Answer, Field(discriminator="type")],
    config=ConfigDict(ser_json_bytes="base64", val_json_bytes="base64"),
)


def instruction_bytes(instruction: Instruction) -> bytes:
    """An instruction as :func:`instruction_of` reads it."""
    return _INSTRUCTIONS.dump_json(instruction)


def instruction_of(data: bytes) -> Instruction:
    """Raises ValueError for anything else."""
    return _INSTRUCTIONS.validate_json(data)


def answer_bytes(answer: Answer) -> bytes:
    """An answer as :func:`answer_of` reads it."""
    return _ANSWERS.dump_json(answer)


def answer_of(data: bytes) -> Answer:
    """Raises ValueError for anything else."""
    return _ANSWERS.validate_json(data)
