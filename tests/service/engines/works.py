"""Work for the tests of engines: what the option ``do`` says, in a real process."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from service.engines.failures import disk_full
from service.engines.worker import TaskCancelledError, TaskFailedError
from service.jobs.job import Failure, Summary
from service.jobs.progress import JobProgress

HELD = []


def start():
    return work


def start_on_demand():
    return make_file


def make_file(task, tell, cancel):
    """As the library's work on demand, or what the job's option ``do`` says."""
    if task.options["do"] != "draw":
        return work(task, tell, cancel)
    with Path(task.options["note"]).open("a") as file:
        file.write(f"{os.getpid()}\n")
    told = " ".join(sorted(task.inputs))
    if task.wanted != "report.html":
        (Path(task.results) / task.wanted).write_text(f"{task.wanted} of {told}")
    else:
        (Path(task.results) / "pictures").mkdir()
        (Path(task.results) / "pictures" / "recall.png").write_bytes(b"recall")
        (Path(task.results) / "report.html").write_text(f"{told} of {task.labels['mesh']}")
    return Summary(triangles=0, input_triangles=0, levels=0, seconds=0.0)


def start_never():
    sys.exit(3)


def start_at_the_fourth_try():
    tries = Path(tempfile.gettempdir()) / "tries"
    with tries.open("a") as file:
        file.write("x")
    if tries.stat().st_size < 4:
        sys.exit(3)
    return work


def start_when_compiled():
    """As the first process does that has to compile, which takes until the file is there."""
    folder = Path(tempfile.gettempdir())
    with (folder / "starts").open("a", buffering=1) as file:
        file.write("begin\n")
        while not (folder / "compiled").exists():
            sum(range(1000))  # a sign of life
        file.write("end\n")
    return work


def work(task, tell, cancel):
    note = Path(task.options.get("note", os.devnull))
    with note.open("a") as file:
        file.write(f"{os.getpid()}\n")
    tell(JobProgress("voxelize", 0.5))
    DEEDS[task.options.get("do", "copy")](task, tell, cancel)
    return Summary(triangles=1, input_triangles=2, levels=1, seconds=0.0, recall=0.5)


def copy(task, tell, cancel):
    text = Path(task.inputs["mesh"]).read_text()
    (Path(task.results) / "pictures").mkdir()
    (Path(task.results) / "lod0.obj").write_text(text)
    (Path(task.results) / "pictures" / "one.png").write_text("picture of " + text)
    (Path(task.results) / "link.json").symlink_to("/etc/hosts")


def die(task, tell, cancel):
    os.kill(os.getpid(), signal.SIGSEGV)


def exit_quietly(task, tell, cancel):
    os._exit(7)


def wait(task, tell, cancel):
    while not cancel.is_set():
        time.sleep(0.01)
    raise TaskCancelledError


def hang(task, tell, cancel):
    """Hears of nothing, as a long kernel does."""
    while True:
        time.sleep(1.0)


def stop_once(task, tell, cancel):
    """As a debugger or an administrator stops a process; the second try is let through."""
    if not Path(task.options["note"]).read_text().count("\n") > 1:
        os.kill(os.getpid(), signal.SIGSTOP)
    copy(task, tell, cancel)


def lock_up(task, tell, cancel):
    lock = threading.Lock()
    lock.acquire()
    lock.acquire()


def compute(task, tell, cancel):
    """Says nothing for a second or more, and lets no other thread of the process run."""
    sum(range(task.options["steps"]))
    copy(task, tell, cancel)


def read_for_ever(task, tell, cancel):
    """A reader in Python that has met its worst case, and words for whatever is raised in it."""
    tell(JobProgress("load", 0.0))
    try:
        while True:
            sum(range(1000))
    except Exception as error:
        raise TaskFailedError(Failure("unreadable-mesh", "it is a cat", "")) from error


def read_in_one_call(task, tell, cancel):
    """A reader that never comes back to Python, but works."""
    tell(JobProgress("load", 0.0))
    hashlib.pbkdf2_hmac("sha256", b"", b"", 1 << 30)


def read_by_threads(task, tell, cancel):
    """What it has begun goes on without it."""
    tell(JobProgress("load", 0.0))
    threading.Thread(target=time.sleep, args=(60.0,), daemon=True).start()
    while True:
        time.sleep(0.01)


def read_then_work(task, tell, cancel):
    """Short reading, long work."""
    tell(JobProgress("load", 0.0))
    tell(JobProgress("voxelize", 0.1))
    end = time.monotonic() + task.options["seconds"]
    while time.monotonic() < end:
        time.sleep(0.01)
    copy(task, tell, cancel)


def fill_once(task, tell, cancel):
    if not Path(task.options["note"]).read_text().count("\n") > 1:
        raise TaskFailedError(disk_full("the work"))
    copy(task, tell, cancel)


def fail(task, tell, cancel):
    raise TaskFailedError(Failure("unreadable-mesh", "it is a cat", "take a dog"))


def fault(task, tell, cancel):
    raise ZeroDivisionError("this is for the log alone")


def allocate(task, tell, cancel):
    HELD.append(bytearray(task.options["bytes"]))


def keep(task, tell, cancel):
    """Memory that the next job finds taken."""
    HELD.append(b"x" * task.options["bytes"])
    copy(task, tell, cancel)


def allocate_in_children(task, tell, cancel):
    """Each within the limit, both beyond it."""
    import subprocess

    script = "import time; held = b'x' * 200_000_000; time.sleep(60)"
    children = [subprocess.Popen([sys.executable, "-c", script]) for _ in range(2)]
    Path(task.options["note"]).write_text("\n".join(str(child.pid) for child in children))
    for child in children:
        child.wait()


def report_surroundings(task, tell, cancel):
    import resource

    facts = [
        os.environ["OCCLUDER_THREADS"],
        os.nice(0),
        resource.getrlimit(resource.RLIMIT_CORE),
        signal.getsignal(signal.SIGINT) == signal.SIG_IGN,
        Path(tempfile.gettempdir()) == Path(task.scratch),
    ]
    with tempfile.NamedTemporaryFile() as file:
        facts.append(oct(Path(file.name).stat().st_mode & 0o777))
    (Path(task.results) / "facts.json").write_text(repr(facts))


def tell_environment(task, tell, cancel):
    (Path(task.results) / "environment.json").write_text(json.dumps(dict(os.environ)))


def look_around(task, tell, cancel):
    from tests.service.engines import ways_out

    found = ways_out.found(task.options["around"])
    (Path(task.results) / "found.json").write_text(json.dumps(found))


DEEDS = {
    one.__name__: one
    for one in (
        copy, die, exit_quietly, wait, hang, fail, fault, allocate, keep, allocate_in_children,
        report_surroundings, stop_once, lock_up, compute, fill_once, read_for_ever,
        read_in_one_call, read_by_threads, read_then_work, tell_environment, look_around,
    )
}  # fmt: skip
