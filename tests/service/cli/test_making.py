"""A build by a service that answers as a test says."""

from __future__ import annotations

import hashlib
import threading
import time
from collections import Counter
from itertools import count

from service.cli.making import maker
from simplifier import __version__
from simplifier.builds.build import build_assets
from simplifier.builds.finding import State
from tests.builds.quick import TRIANGLE, write
from tests.service.client.scripted import Reply, events, job, problem, serving, summary

MESHES = {f"m{i}": TRIANGLE + f"# {i}\n".encode() for i in range(40)}
FOLLOWED = 150
FILE = b"an occluder"
REPORT = {
    "triangles": 12, "precision": 0.99, "recall": 0.9, "deviation": 0.1, "error_bound": None,
    "version": __version__, "warnings": [], "overhang": {"share": 0.004},
    "verdict": {"word": "good", "reason": "it is", "next": None},
}  # fmt: skip


DONE = job("succeeded", summary=summary(), version=__version__)
RESULT = Reply({"job": DONE, "report": REPORT, "levels": [], "files": []})
OCCLUDER = Reply(FILE, headers={"ETag": f'"{hashlib.sha256(FILE).hexdigest()}"'})


def built_by(answer, manifest):
    with serving(answer) as address, maker(address, None, threading.Event()) as remote:
        return build_assets(manifest, threading.Event(), maker=remote)


def test_few_send_at_a_time_and_a_full_queue_is_tried_again(tmp_path):
    """Each mesh is refused once, as by a queue that is full."""
    manifest, lock, asked = write(tmp_path, **MESHES), threading.Lock(), Counter()
    sending = most = 0

    def answer(request):
        nonlocal sending, most
        if request.method == "GET":
            return RESULT if request.path.endswith("/result") else OCCLUDER
        with lock:
            asked[request.body] += 1
            sending += 1
            most = max(most, sending)
        time.sleep(0.01)
        with lock:
            sending -= 1
        if asked[request.body] == 1:
            full = problem(429, "queue-full", "1000 jobs are waiting")
            return Reply(full.body, 429, {"Retry-After": "0"})
        return RESULT

    found = built_by(answer, manifest)
    assert {one.state for one in found} == {State.BUILT}, found[0].faults
    assert asked == dict.fromkeys(MESHES.values(), 2)
    assert 1 < most <= 8
    assert (tmp_path / "m7_occluder.glb").read_bytes() == FILE


def test_each_job_under_way_is_followed_however_many_they_are(tmp_path):
    """None ends before all are followed, over a connection each."""
    manifest = write(tmp_path, **{f"m{i}": TRIANGLE for i in range(FOLLOWED)})
    together, ids = threading.Barrier(FOLLOWED, timeout=60), count()

    def answer(request):
        if request.method == "POST":
            return Reply(job("queued", id=f"j{next(ids)}", version=__version__), 202)
        if request.path.endswith("/events"):
            together.wait()
            return events(("state", DONE))
        return RESULT if request.path.endswith("/result") else OCCLUDER

    found = built_by(answer, manifest)
    assert {one.state for one in found} == {State.BUILT}, found[0].faults
