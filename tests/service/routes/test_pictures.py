"""The best so far of a running job over HTTP."""

from __future__ import annotations

import hashlib

from service.jobs.progress import JobProgress, Snapshot
from tests.service.routes.serving import problem

PNG = b"\x89PNG\r\n\x1a\n and so on"


def test_the_latest_picture_is_given_while_the_job_runs(service):
    job_id = service.queued()
    place = f"/v1/jobs/{job_id}"
    problem(service.http.get(f"{place}/picture"), 404, "not-found")
    service.hand.begin()
    board = service.services.board
    board.tell(job_id, JobProgress("refine", 0.4, 0.7))
    told = problem(service.http.get(f"{place}/picture"), 404, "not-found")
    assert "while it refines" in told["remedy"]
    for number in (1, 2):
        png = PNG + bytes([number])
        board.tell(job_id, JobProgress("refine", 0.5, 0.8, picture=Snapshot(number, png)))
        board.tell(job_id, JobProgress("refine", 0.6, 0.8))
        link = service.http.get(place).json()["progress"]["picture"]
        assert link == f"{place}/picture?n={number}"
        answer = service.http.get(link)
        assert (answer.status_code, answer.content) == (200, png)
        assert answer.headers["content-type"] == "image/png"
        assert answer.headers["cache-control"] == "no-store"
        etag = answer.headers["etag"]
        assert etag == f'"{hashlib.sha256(png).hexdigest()}"'
        again = service.http.get(link, headers={"If-None-Match": etag})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
    service.hand.succeed()
    problem(service.http.get(f"{place}/picture?n=2"), 404, "not-found")


def test_a_picture_of_no_job_and_of_no_number(service):
    problem(service.http.get("/v1/jobs/none/picture"), 404, "not-found")
    told = problem(service.http.get("/v1/jobs/none/picture?n=x"), 422, "invalid-options")
    assert [one["field"] for one in told["errors"]] == ["n"]
