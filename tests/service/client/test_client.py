"""The client against a server that misbehaves as told."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import threading
from itertools import count

import pytest

from service.client import Client, ClientError, Keep, Priority, StoppedError
from service.jobs.asset import Thresholds
from service.jobs.deliveries import DeliveryState
from service.jobs.job import Failure, JobState
from tests.service.client.scripted import (
    DROP,
    Reply,
    events,
    form_of,
    job,
    problem,
    serving,
    summary,
)


@pytest.fixture
def talk():
    """``talk(*replies)``: a client, and the requests that it sent; the last reply is repeated."""
    open_now = []

    def begin(*replies, **settings):
        seen = []

        def answer(request):
            seen.append(request)
            return replies[min(len(seen), len(replies)) - 1]

        server = serving(answer)
        client = Client(server.__enter__(), **settings)
        open_now.append((server, client))
        return client, seen

    yield begin
    for server, client in open_now:
        client.close()
        server.__exit__(None, None, None)


def test_a_mesh_goes_as_it_is_with_its_options_in_the_address(talk, tmp_path):
    client, seen = talk(Reply(job(), 202), key="occ_secret")
    mesh = tmp_path / "a castle.obj"
    mesh.write_bytes(bytes(range(256)) * 4000)
    shares = []
    options = {"budget": 32, "ground": True, "error_bounds": [0.1, 0.4]}
    told = client.submit(mesh, options=options, asset="props/castle", tell=shares.append)
    [sent] = seen
    assert sent.body == mesh.read_bytes()
    assert "transfer-encoding" not in sent.headers  # so that the server knows the length at once
    assert sent.headers["authorization"] == "Bearer occ_secret"
    assert sent.query == {
        "budget": ["32"], "ground": ["true"], "error_bounds": ["0.1,0.4"],
        "asset": ["props/castle"], "filename": ["a castle.obj"],
    }  # fmt: skip
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert (told.id, told.state, told.asset_id) == ("j1", JobState.QUEUED, "a1")


def test_a_client_says_how_much_its_jobs_hurry_and_keep(talk, tmp_path):
    client, seen = talk(
        Reply(job(priority="bulk", keep="lean"), 202), priority=Priority.BULK, keep=Keep.LEAN
    )
    told = client.submit(b"mesh", name="mesh.obj")
    assert (told.priority, told.keep) == (Priority.BULK, Keep.LEAN)
    by_hand = tmp_path / "mesh.overrides.toml"
    by_hand.write_text("")
    client.submit(b"mesh", name="mesh.obj", overrides=by_hand)
    assert (seen[0].query["priority"], seen[0].query["keep"]) == (["bulk"], ["lean"])
    assert b'name="priority"\r\n\r\nbulk\r\n' in seen[1].body
    assert b'name="keep"\r\n\r\nlean\r\n' in seen[1].body


@pytest.mark.parametrize(
    ("submit", "path"), [("submit_scene", "/v1/scenes"), ("submit_visibility", "/v1/visibility")]
)
def test_a_scene_goes_as_it_is(talk, submit, path):
    client, seen = talk(Reply(job(), 202))
    assert getattr(client, submit)(b"glTF", name="town.glb", options={"up": "z"}).id == "j1"
    [sent] = seen
    assert (sent.path, sent.body) == (path, b"glTF")
    assert sent.query == {"up": ["z"], "filename": ["town.glb"]}


def test_a_stored_result_is_a_job_that_has_succeeded(talk):
    done = job("succeeded", summary=summary())
    client, _ = talk(Reply({"job": done, "report": None, "levels": [], "files": []}))
    told = client.submit(b"mesh", name="mesh.obj")
    assert told.state is JobState.SUCCEEDED
    assert told.summary.recall == 0.9


def test_a_lost_answer_is_asked_for_again_under_the_same_key(talk):
    client, seen = talk(DROP, DROP, Reply(job(), 202))
    client.submit(b"mesh", name="mesh.obj")
    keys = [request.headers["idempotency-key"] for request in seen]
    assert len(keys) == 3
    assert len(set(keys)) == 1
    assert all(request.body == b"mesh" for request in seen)


def test_whatever_changes_something_is_sent_again_under_the_same_key(talk):
    client, seen = talk(DROP, Reply(status=204))
    client.remove_asset("a1")
    assert [request.method for request in seen] == ["DELETE"] * 2
    assert len({request.headers["idempotency-key"] for request in seen}) == 1


def test_a_request_of_which_the_first_copy_is_worked_on_waits_for_its_answer(talk):
    busy = problem(409, "request-under-way", "it is still being worked on")
    client, seen = talk(Reply(busy.body, 409, {"Retry-After": "0"}), Reply(job(), 202))
    assert client.submit(b"mesh", name="mesh.obj").id == "j1"
    assert len({request.headers["idempotency-key"] for request in seen}) == 1
    assert len(seen) == 2


def test_two_submissions_have_two_keys(talk):
    client, seen = talk(Reply(job(), 202))
    client.submit(b"mesh", name="mesh.obj")
    client.submit(b"mesh", name="mesh.obj")
    assert len({request.headers["idempotency-key"] for request in seen}) == 2


def test_a_full_queue_is_tried_again_when_the_server_says(talk):
    full = problem(429, "queue-full", "1000 jobs are waiting")
    client, seen = talk(Reply(full.body, 429, {"Retry-After": "0"}), Reply(job(), 202))
    client.submit(b"mesh", name="mesh.obj")
    assert len(seen) == 2


def test_patience_has_an_end(talk):
    full = problem(429, "queue-full", "1000 jobs are waiting")
    client, seen = talk(Reply(full.body, 429, {"Retry-After": "3600"}))
    with pytest.raises(ClientError, match="1000 jobs are waiting; do better") as refused:
        client.submit(b"mesh", name="mesh.obj")
    assert refused.value.problem.slug == "queue-full"
    assert refused.value.problem.status == 429
    assert len(seen) == 1


def test_a_refusal_names_each_field(talk):
    errors = [{"field": "budget", "detail": "is 0", "remedy": "give 1 to 100,000"}]
    client, seen = talk(problem(422, "invalid-options", "budget: is 0", errors=errors))
    with pytest.raises(ClientError, match="budget: is 0") as refused:
        client.submit(b"mesh", name="mesh.obj", options={"budget": 0})
    assert refused.value.problem.errors[0].remedy == "give 1 to 100,000"
    assert len(seen) == 1


def test_what_is_no_service_is_told_apart(talk):
    client, _ = talk(Reply(b"<html>", 404))
    with pytest.raises(ClientError, match="check that an occluder service is at this address"):
        client.job("j1")


def test_bytes_need_a_name(talk):
    client, _ = talk(Reply(job(), 202))
    with pytest.raises(ValueError, match="bytes need a name"):
        client.submit(b"mesh")


def test_progress_and_states_are_followed_to_the_end(talk):
    step = {
        "stage": "refine",
        "fraction": 0.5,
        "measure": 0.4,
        "level": 0,
        "levels": 3,
        "picture": "/v1/jobs/j1/picture?n=2",
    }
    failure = {"kind": "out-of-time", "detail": "it took long", "remedy": "give it more"}
    stream = events(
        ("state", job("running")), ("progress", step), ("state", job("failed", failure=failure))
    )
    client, seen = talk(stream)
    told = []
    end = client.wait("j1", told.append)
    assert [one.state for one in told] == ["running", "running", "failed"]
    assert told[1].progress.fraction == 0.5
    assert told[1].progress.picture == "/v1/jobs/j1/picture?n=2"
    assert end.failure == Failure("out-of-time", "it took long", "give it more")
    assert [request.path for request in seen] == ["/v1/jobs/j1/events"]


def test_a_job_is_run_again_with_other_options_and_an_asset_swept(talk):
    client, seen = talk(Reply(job(), 202))
    calls = (
        lambda: client.rerun("j1", {"budget": 32, "error_bounds": [0.1, 0.4]}),
        lambda: client.rerun("j1"),
        lambda: client.tradeoff("a1", {"budgets": [16, 32]}),
        lambda: client.tradeoff("a1"),
    )
    assert [call().state for call in calls] == [JobState.QUEUED] * 4
    assert [(one.method, one.path, json.loads(one.body)) for one in seen] == [
        ("POST", "/v1/jobs/j1/rerun", {"options": {"budget": 32, "error_bounds": [0.1, 0.4]}}),
        ("POST", "/v1/jobs/j1/rerun", {"options": {}}),
        ("POST", "/v1/assets/a1/tradeoff", {"budgets": [16, 32]}),
        ("POST", "/v1/assets/a1/tradeoff", {}),
    ]


def test_a_broken_stream_is_taken_up_again(talk):
    whole = events(("state", job("running")), ("state", job("succeeded")))
    client, seen = talk(
        events(("state", job("running")), ("state", job("running")), cut=700),
        Reply(job("running")),
        whole,
    )
    client._wire.pause = lambda seconds: None
    assert client.wait("j1").state is JobState.SUCCEEDED
    assert [request.path for request in seen] == [
        "/v1/jobs/j1/events", "/v1/jobs/j1", "/v1/jobs/j1/events",
    ]  # fmt: skip


def test_without_events_the_job_is_asked_for(talk):
    empty = Reply(b"", headers={"Content-Type": "text/event-stream"})
    client, _ = talk(empty, Reply(job("running")), empty, Reply(job("cancelled")))
    client._wire.pause = lambda seconds: None
    assert client.wait("j1").state is JobState.CANCELLED


def test_a_file_arrives_whole_or_not_at_all(talk, tmp_path):
    data = bytes(range(256)) * 100
    whole = Reply(data, headers={"ETag": f'"{hashlib.sha256(data).hexdigest()}"'})
    cut = Reply(data, headers=whole.headers, cut=1000)
    bent = Reply(data[::-1], headers=whole.headers)
    client, seen = talk(cut, bent, whole)
    target = tmp_path / "castle.glb"
    client.download("j1", target)
    assert target.read_bytes() == data
    assert seen[0].path == "/v1/jobs/j1/files/occluder.glb"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_stays_damaged_leaves_what_was_there(talk, tmp_path):
    client, _ = talk(Reply(b"other", headers={"ETag": '"' + "0" * 64 + '"'}))
    target = tmp_path / "castle.obj"
    target.write_bytes(b"old")
    with pytest.raises(ClientError, match="did not arrive as announced"):
        client.download("j1", target, level=1, form="obj")
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_cancelling_what_has_ended_is_no_failure(talk):
    client, seen = talk(problem(409, "conflict", "it has ended"), Reply(job("succeeded")))
    assert client.cancel("j1").state is JobState.SUCCEEDED
    assert [request.method for request in seen] == ["POST", "GET"]


def test_pages_are_asked_for_as_they_are_reached(talk):
    client, seen = talk(
        Reply({"items": [job(id="a"), job(id="b")], "next": "/v1/jobs?cursor=2"}),
        Reply({"items": [job(id="c")], "next": None}),
    )
    found = client.jobs(states=[JobState.FAILED, JobState.CANCELLED])
    assert next(found).id == "a"
    assert len(seen) == 1
    assert [one.id for one in found] == ["b", "c"]
    assert seen[0].query == {"state": ["failed", "cancelled"]}
    assert seen[1].query == {"cursor": ["2"]}


def test_thresholds_go_and_come_back(talk):
    body = {
        "id": "a1", "name": "props/castle", "created": "2025-01-02T03:04:05Z", "runs": 2,
        "thresholds": {"min_precision": 0.99, "min_recall": None}, "holds": False,
        "latest": job("succeeded"), "links": {},
    }  # fmt: skip
    client, seen = talk(Reply(body))
    asset = client.put_asset("props/castle", Thresholds(min_precision=0.99))
    assert json.loads(seen[0].body) == {
        "name": "props/castle", "min_precision": 0.99, "min_recall": None, "max_overhang": None,
    }  # fmt: skip
    assert asset.thresholds == Thresholds(0.99, None)
    assert asset.holds is False


def test_an_evaluation_sends_both_files_in_each_try(talk, tmp_path):
    for name in ("mesh.obj", "occluder.ply"):
        (tmp_path / name).write_bytes(name.encode())
    client, seen = talk(DROP, Reply(job(kind="evaluation"), 202))
    client.evaluate(tmp_path / "mesh.obj", tmp_path / "occluder.ply", options={"views": 8})
    assert len(seen) == 2
    for request in seen:
        for part in (b'name="mesh"; filename="mesh.obj"', b"\r\noccluder.ply\r\n", b'{"views": 8}'):
            assert part in request.body


KEEP = b'[ignore]\nmeshes = ["flag"]\n'


def test_overrides_go_along_with_the_mesh_as_it_is_read(talk, tmp_path):
    client, seen = talk(DROP, DROP, Reply(job(), 202))
    mesh, keep = tmp_path / "a castle.obj", tmp_path / "of the castle"
    mesh.write_bytes(bytes(range(256)) * 4000)
    keep.write_bytes(KEEP)
    shares = []
    told = client.submit(
        mesh, options={"budget": 32, "ground": True}, asset="props/castle", overrides=keep,
        tell=shares.append,
    )  # fmt: skip
    assert told.id == "j1"
    assert len({request.headers["idempotency-key"] for request in seen}) == 1
    for request in seen:
        assert "transfer-encoding" not in request.headers
        assert int(request.headers["content-length"]) == len(request.body)
        form = form_of(request)
        assert json.loads(form["options"][2]) == {"budget": 32, "ground": True}
        assert form["asset"][2] == b"props/castle"
        assert form["mesh"][::2] == ("a castle.obj", mesh.read_bytes())
        assert form["overrides"] == ("of the castle", "application/toml", KEEP)
        assert set(form) == {"options", "asset", "mesh", "overrides"}
    begun = [0, *(at for at in range(1, len(shares)) if shares[at] < shares[at - 1])]
    assert len(begun) == 3  # each try from the begin
    assert shares[begun[-1] :] == sorted(shares[begun[-1] :])
    assert shares[-1] == 1.0
    assert len(shares) > 3 * 8  # never much of it in memory


def test_bytes_go_with_overrides_too(talk, tmp_path):
    client, seen = talk(Reply(job(), 202))
    (tmp_path / "keep.toml").write_bytes(KEEP)
    client.submit(b"mesh", name="mesh.obj", overrides=tmp_path / "keep.toml")
    assert set(form_of(seen[0])) == {"mesh", "overrides"}
    with pytest.raises(FileNotFoundError):
        client.submit(b"mesh", name="mesh.obj", overrides=tmp_path / "none.toml")
    assert len(seen) == 1


def test_an_evaluation_takes_overrides(talk, tmp_path):
    for name in ("mesh.obj", "occluder.ply", "keep.toml"):
        (tmp_path / name).write_bytes(name.encode())
    client, seen = talk(Reply(job(kind="evaluation"), 202))
    client.evaluate(
        tmp_path / "mesh.obj", tmp_path / "occluder.ply", overrides=tmp_path / "keep.toml"
    )
    assert form_of(seen[0])["overrides"] == ("keep.toml", "application/toml", b"keep.toml")


def test_an_unknown_member_is_left_aside(talk):
    client, _ = talk(Reply(job(colour="blue", summary=summary(colour="blue"))))
    assert client.job("j1").summary.triangles == 64


def test_a_stop_ends_a_long_wait(talk):
    stop = threading.Event()
    full = problem(429, "queue-full", "1000 jobs are waiting")
    client, _ = talk(Reply(full.body, 429, {"Retry-After": "50"}), stop=stop)
    threading.Timer(0.1, stop.set).start()
    with pytest.raises(StoppedError):
        client.submit(b"mesh", name="mesh.obj")


def test_a_stop_ends_an_upload():
    stop = threading.Event()
    chunks = count()

    def tell(share):
        if next(chunks) == 3:
            stop.set()

    with (
        serving(lambda request: Reply(job(), 202)) as address,
        Client(address, stop=stop) as client,
        pytest.raises(StoppedError),
    ):
        client.submit(bytes(1 << 24), name="mesh.obj", tell=tell)
    assert next(chunks) < 10


def test_it_needs_nothing_of_the_server():
    heavy = (
        "numpy",
        "numba",
        "fastapi",
        "starlette",
        "sqlalchemy",
        "pydantic",
        "simplifier.pipeline",
    )
    code = f"import sys, service.client; print([m for m in {heavy!r} if m in sys.modules])"
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert shown.strip() == "[]"


def test_webhooks_are_listed_and_sent_again(talk):
    told = {
        "id": "d7", "job": "/v1/jobs/j1", "state": "given_up", "url": "https://ci.example.org/x",
        "created": "2026-01-01T00:00:00Z", "due": None, "redelivered": 0, "new member": 1,
        "attempts": [
            {"at": "2026-01-01T00:00:01Z", "milliseconds": 12.5, "status": 500,
             "reason": "the receiver answered 500", "excerpt": "no such hook"},
        ],
    }  # fmt: skip
    client, seen = talk(
        Reply(body={"items": [told], "next": None}), Reply({**told, "state": "waiting"}, 202)
    )
    (lost,) = client.deliveries(state=DeliveryState.GIVEN_UP, job_id="j1")
    assert (lost.id, lost.state, lost.attempts[0].status) == ("d7", DeliveryState.GIVEN_UP, 500)
    assert client.redeliver(lost.id).state is DeliveryState.WAITING
    assert [one.path for one in seen] == ["/v1/deliveries", "/v1/deliveries/d7/redeliver"]
    assert seen[0].query == {"state": ["given_up"], "job": ["j1"]}
