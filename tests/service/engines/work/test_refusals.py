"""What a job's owner is told of the library's errors."""

from __future__ import annotations

import errno
from dataclasses import replace

import numpy as np
import pytest

import simplifier
from service.engines.messages import Task
from service.engines.work.refusals import refusals
from service.engines.worker import TaskCancelledError, TaskFailedError
from service.jobs.job import JobKind

INPUTS = {
    "mesh": "/data/job/input/mesh.obj",
    "occluder": "/data/job/input/occluder.stl",
    "overrides": "/data/job/input/overrides.toml",
}
TASK = Task(
    JobKind.EVALUATION, "cat.obj", {}, INPUTS, "/data/job/results", "/data/job/scratch", 1, 1, 1,
    {"mesh": "cat.obj", "occluder": "cat.obj", "overrides": "cat.overrides.toml"},
)  # fmt: skip

NOTHING = simplifier.Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))


def failure_of(error):
    with pytest.raises(TaskFailedError) as caught, refusals(TASK):
        raise error
    return caught.value.failure


@pytest.mark.parametrize(
    ("where", "words"),
    [
        (INPUTS["mesh"], "cat.obj: what"),
        (INPUTS["occluder"], "occluder: what"),
        (f"{INPUTS['overrides']}:7", "cat.overrides.toml:7: what"),
        ("/data/job/scratch/unpacked/town/a.obj", "cat.obj/town/a.obj: what"),
        ("", "what"),
    ],
)
def test_files_have_the_names_that_their_owner_knows(where, words):
    failure = failure_of(simplifier.UnreadableMeshError("what", where=where, remedy="do"))
    assert (failure.kind, failure.detail, failure.remedy) == ("unreadable-mesh", words, "do")


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (simplifier.UnknownFormatError("x"), "unreadable-mesh"),
        (simplifier.EmptyMeshError("x"), "unreadable-mesh"),
        (simplifier.OptionError("x", where="budget"), "invalid-options"),
        (simplifier.OverridesError("x"), "invalid-overrides"),
        (simplifier.BackendUnavailableError("x"), "unavailable"),
        (OSError(errno.ENOSPC, "no space"), "disk-full"),
    ],
)
def test_each_error_has_its_kind(error, kind):
    assert failure_of(error).kind == kind


def test_remedies_name_options_as_a_request_does():
    task = replace(TASK, options={"eye_height": 1.7, "up": "z"})
    said = "choose another --eye-height or --up, or install it --quietly"
    with pytest.raises(TaskFailedError) as caught, refusals(task):
        raise simplifier.OptionError("x", where="cells", remedy=said)
    told = "choose another eye_height or up, or install it --quietly"
    assert caught.value.failure.remedy == told


def test_a_full_disk_is_found_behind_what_the_library_says_of_it(monkeypatch, tmp_path):
    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(TaskFailedError) as caught, refusals(TASK):
        simplifier.save(NOTHING, tmp_path / "a.ply")
    assert caught.value.failure.kind == "disk-full"


def test_what_is_no_refusal_passes_through():
    for error in (simplifier.OutputError("x"), ZeroDivisionError(), OSError(errno.EACCES, "no")):
        with pytest.raises(type(error)), refusals(TASK):
            raise error
    with pytest.raises(TaskCancelledError), refusals(TASK):
        raise simplifier.CancelledError("x")
    with pytest.raises(MemoryError), refusals(TASK):
        raise RuntimeError("can't start new thread")
