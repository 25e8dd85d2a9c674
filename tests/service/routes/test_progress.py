"""Server-sent events, and waits that end when nobody waits any more."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import Iterator

from service.answers.following import news
from service.jobs.progress import JobProgress
from tests.service.routes.serving import OBJ
from tests.waiting import until


def events(lines: Iterator[str]) -> Iterator[tuple[str, dict]]:
    for line in lines:
        if line.startswith("event: "):
            name = line.removeprefix("event: ")
            yield name, json.loads(next(lines).removeprefix("data: "))


def test_a_job_is_followed_from_its_present_state_to_its_end(service):
    job_id = service.queued()
    with service.http.stream("GET", f"/v1/jobs/{job_id}/events") as response:
        assert response.headers["content-type"].startswith("text/event-stream")
        told = events(response.iter_lines())
        assert [next(told)] == [("state", service.http.get(f"/v1/jobs/{job_id}").json())]
        service.hand.begin()
        name, job = next(told)
        assert (name, job["state"]) == ("state", "running")
        service.services.board.tell(job_id, JobProgress("refine", 0.4, 0.7))
        name, progress = next(told)
        assert (name, progress["stage"], progress["fraction"]) == ("progress", "refine", 0.4)
        service.hand.succeed()
        name, job = next(told)
        assert (name, job["state"], job["progress"]) == ("state", "succeeded", None)
        assert list(told) == []


def test_a_job_that_has_ended_is_told_once(service):
    job_id = service.done()
    with service.http.stream("GET", f"/v1/jobs/{job_id}/events") as response:
        told = list(events(response.iter_lines()))
    assert [(name, job["id"]) for name, job in told] == [("state", job_id)]


def test_many_follow_one_job_and_leave_nothing_behind(service):
    job_id = service.queued()
    ends: list[str] = []

    def follow() -> None:
        with service.http.stream("GET", f"/v1/jobs/{job_id}/events") as response:
            ends.append(list(events(response.iter_lines()))[-1][1]["state"])

    followers = [threading.Thread(target=follow) for _ in range(16)]
    for follower in followers:
        follower.start()
    until(lambda: len(listeners(service, job_id)) == 16)
    service.hand.begin()
    service.hand.succeed()
    for follower in followers:
        follower.join()
    assert ends == ["succeeded"] * 16
    until(lambda: not listeners(service, job_id))


def test_silence_is_broken_now_and_then(service):
    job = service.services.jobs.job(None, service.queued())

    async def first_two():
        told = news(service.services.jobs, service.services.board, job, 0.01)
        heard = [await anext(told), await anext(told)]
        await told.aclose()
        return heard

    assert asyncio.run(first_two()) == [job, None]
    assert not listeners(service, job.id)
    service.http.post(f"/v1/jobs/{job.id}/cancel")


def test_a_stream_ends_when_its_job_is_removed(service):
    job_id = service.queued("/v1/occluders?filename=a.obj&asset=removed")
    asset = service.http.get(f"/v1/jobs/{job_id}").json()["asset"]["id"]
    with service.http.stream("GET", f"/v1/jobs/{job_id}/events") as response:
        told = events(response.iter_lines())
        next(told)
        service.services.jobs.cancel(None, job_id)
        assert service.http.delete(f"/v1/assets/{asset}").status_code == 204
        service.services.board.announce(job_id)
        assert list(told) == []


def test_a_wait_ends_when_its_client_goes(service):
    body = OBJ + b"# gone\n"
    url = service.http.base_url
    with socket.create_connection((url.host, url.port)) as line:
        line.sendall(
            b"POST /v1/occluders?filename=a.obj HTTP/1.1\r\nHost: localhost\r\nPrefer: wait=60\r\n"
            b"Content-Length: %d\r\n\r\n%s" % (len(body), body)
        )
        until(lambda: service.services.jobs.counts().get("queued", 0) > 0)
        job = service.http.get("/v1/jobs?state=queued").json()["items"][0]
        until(lambda: len(listeners(service, job["id"])) == 1)
    until(lambda: not listeners(service, job["id"]), seconds=2.0)
    service.http.post(job["links"]["cancel"])


def listeners(service, job_id):
    return service.services.board._listeners.get(job_id, ())
