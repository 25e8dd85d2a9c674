"""Why a job ends without a result, for its owner."""

from __future__ import annotations

from service.jobs.job import Failure

_REPORT = "report it, with the mesh and the options"
_DISK_FULL = "disk-full"


def out_of_memory(limit: int) -> Failure:
    """It wanted more than so many bytes."""
    return Failure(
        "out-of-memory",
        f"the job needs more than the {limit >> 20:,} MiB that a job may use",
        "choose a lower resolution or a smaller mesh, or raise OCCLUDER_JOB_MEMORY",
    )


def too_much_memory(told: str, remedy: str, limit: int) -> Failure:
    """The library told before it began; ``remedy`` is its own, which ends with another limit."""
    coarser = remedy.partition(", or set ")[0] if ", or set " in remedy else "thin the mesh"
    return Failure(
        "out-of-memory",
        f"{told}, {limit >> 20:,} MiB of it for the job beside its process",
        f"{coarser}, or raise OCCLUDER_JOB_MEMORY",
    )


def out_of_time(seconds: float) -> Failure:
    """It wanted more than so many seconds."""
    return Failure(
        "out-of-time",
        f"the job takes longer than the {seconds:,.6g} seconds that a job may take",
        "choose the preset draft, fewer moves or a time limit, or raise OCCLUDER_JOB_SECONDS",
    )


def out_of_reading_time(seconds: float) -> Failure:
    """What was sent wanted more than so many seconds to be read."""
    return Failure(
        "out-of-time",
        f"reading takes longer than the {seconds:,.6g} seconds that reading may take",
        "send a smaller file, or a binary format in place of a textual one, or raise "
        "OCCLUDER_READ_SECONDS",
    )


def process_died(how: str) -> Failure:
    """The process that did it is gone; ``how`` continues "its process"."""
    return Failure(
        "process-died",
        f"its process {how}",
        "try again; if that ends alike, the mesh may be too large for this machine",
    )


def process_silent(seconds: float) -> Failure:
    """The process was there, and did nothing for so long."""
    return process_died(f"gave no sign of life for {seconds:,.6g} seconds")


def server_ended() -> Failure:
    """The server was killed while the job ran."""
    return Failure("process-died", "the server ended while it was at the job", "try again")


def disk_full(what: str) -> Failure:
    """``what`` could not be written."""
    return Failure(
        _DISK_FULL,
        f"there is no room for {what}",
        "free some space on the disk of OCCLUDER_DATA, then try again",
    )


def is_disk_full(failure: Failure) -> bool:
    """Whether it is the machine's, and may be over some day."""
    return failure.kind == _DISK_FULL


def upload_gone() -> Failure:
    """A blob that a row names is not there."""
    return Failure("upload-lost", "the upload is no longer stored", "upload it again")


def upload_damaged() -> Failure:
    """A blob that a row names has other bytes than were sent."""
    return Failure("upload-lost", "the upload was damaged on the service's disk", "upload it again")


def misread() -> Failure:
    """The process read other bytes than the server did right after it."""
    return process_died("read the upload otherwise than it is stored")


def program_fault(error: BaseException) -> Failure:
    """What nobody has thought of; the log has the rest."""
    return Failure("internal-error", f"the work failed by {type(error).__name__}", _REPORT)
