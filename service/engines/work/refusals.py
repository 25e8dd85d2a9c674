"""What the library refuses, in words for the job's owner: no path of this machine among them.

Whatever does tasks in place of the library's work has to refuse as it does.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager

import simplifier
from service.engines.failures import disk_full, too_much_memory
from service.engines.messages import Task
from service.engines.work.inputs import task_memory, without_paths
from service.engines.worker import TaskCancelledError, TaskFailedError
from service.jobs.job import Failure

_OPTION = re.compile(r"--([a-z]+(?:-[a-z]+)*)")
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_KINDS = {
    simplifier.MeshError: "unreadable-mesh",
    simplifier.OptionError: "invalid-options",
    simplifier.OverridesError: "invalid-overrides",
    simplifier.BackendUnavailableError: "unavailable",
}


@contextmanager
def refusals(task: Task) -> Iterator[None]:
    """Raise what a task may raise; faults of the program pass through."""
    try:
        yield
    except simplifier.CancelledError as error:
        raise TaskCancelledError from error
    except simplifier.MemoryLimitError as error:
        limit = task_memory(task)
        raise TaskFailedError(too_much_memory(error.what, error.remedy, limit)) from error
    except tuple(_KINDS) as error:
        kind = next(kind for of, kind in _KINDS.items() if isinstance(error, of))
        raise TaskFailedError(_failure(kind, error, task)) from error
    except (simplifier.OutputError, OSError) as error:
        if _lacks_room(error):
            raise TaskFailedError(disk_full("the work")) from error
        raise
    except RuntimeError as error:
        # What a thread's stack has no room for; nothing else that is raised is so.
        if "can't start new thread" in str(error):
            raise MemoryError from error
        raise


def _failure(kind: str, error: simplifier.OccluderError, task: Task) -> Failure:
    where = without_paths(error.where, task)
    what = without_paths(error.what, task)
    remedy = _without_dashes(error.remedy, task.options)
    return Failure(kind, f"{where}: {what}" if where else what, remedy)


def _without_dashes(remedy: str, options: Collection[str]) -> str:
    """A remedy that names options as the command line does, with their names in a request."""

    def named(found: re.Match[str]) -> str:
        name = found[1].replace("-", "_")
        return name if name in options else found[0]

    return _OPTION.sub(named, remedy)


def _lacks_room(error: BaseException | None) -> bool:
    """Whether the disk was full; the library's own error came while it heard of that."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _NO_ROOM:
            return True
        error = error.__context__
    return False
