"""Jobs: list, one, cancel, retry."""

from __future__ import annotations

import socket
from urllib.parse import parse_qs, urlsplit

import pytest

from service.jobs.progress import JobProgress
from tests.service.routes.serving import OBJ, problem, served


def test_a_running_job_says_how_far_it_is(service):
    job_id = service.queued()
    service.hand.begin()
    service.services.board.tell(job_id, JobProgress("refine", 0.4, 0.7, 1, 3, 2.5))
    job = service.http.get(f"/v1/jobs/{job_id}").json()
    assert (job["state"], job["attempt"]) == ("running", 1)
    assert job["progress"] == {
        "stage": "refine", "fraction": 0.4, "measure": 0.7, "level": 1, "levels": 3, "seconds": 2.5,
        "picture": None,
    }  # fmt: skip
    service.hand.succeed()
    job = service.http.get(f"/v1/jobs/{job_id}").json()
    assert job["progress"] is None
    assert job["summary"]["warnings"] == ["one hole"]
    assert job["ended"] >= job["started"] >= job["created"]


def test_lists_are_read_page_by_page_newest_first(service):
    ids = [service.queued("/v1/occluders?filename=a.obj&asset=listed") for _ in range(5)]
    asset = service.http.get(f"/v1/jobs/{ids[0]}").json()["asset"]["id"]
    seen: list[str] = []
    page = f"/v1/jobs?asset={asset}&limit=2&state=queued&state=running"
    while page:
        body = service.http.get(page).json()
        seen += [job["id"] for job in body["items"]]
        page = body["next"]
        if page:
            assert parse_qs(urlsplit(page).query)["state"] == ["queued", "running"]
    assert seen == ids[::-1]
    for job_id in ids:
        service.http.post(f"/v1/jobs/{job_id}/cancel")
    assert service.http.get(f"/v1/jobs?asset={asset}&state=queued").json()["items"] == []
    both = service.http.get(f"/v1/jobs?asset={asset}&state=queued&state=cancelled").json()
    assert len(both["items"]) == 5


def test_lists_are_filtered_by_time_and_kind(service):
    job = service.http.get(f"/v1/jobs/{service.done()}").json()
    newer = {"created_from": job["created"]}
    older = {"created_before": job["created"]}
    for times, there in ((newer, True), (older, False)):
        items = service.http.get("/v1/jobs", params={**times, "limit": 500}).json()["items"]
        assert (job["id"] in [one["id"] for one in items]) is there
    assert service.http.get("/v1/jobs?kind=scene&state=succeeded").json()["items"] == []


@pytest.mark.parametrize(
    "query", ["limit=0", "limit=501", "cursor=x", "state=odd", "created_from=yesterday",
              "created_from=0.5", "created_from=2024-01-01T00:00:00", "order=up",
              "cursor=" + "9" * 30],
)  # fmt: skip
def test_a_list_that_cannot_be_had_names_the_field(service, query):
    told = problem(service.http.get(f"/v1/jobs?{query}"), 422, "invalid-options")
    assert query.startswith(told["errors"][0]["field"].split(".")[0])


def test_a_queued_job_is_cancelled_at_once_and_a_running_one_asked_to_end(service):
    job_id = service.queued()
    cancelled = service.http.post(f"/v1/jobs/{job_id}/cancel").json()
    assert cancelled["state"] == "cancelled"
    problem(service.http.post(f"/v1/jobs/{job_id}/cancel"), 409, "conflict")
    job_id = service.queued()
    service.hand.begin()
    service.hand.woken.clear()
    assert service.http.post(f"/v1/jobs/{job_id}/cancel").json()["state"] == "running"
    assert service.hand.woken.is_set()
    service.hand.end_cancelled()


def test_a_failed_job_is_done_again_with_the_same_input(service):
    job_id = service.queued("/v1/occluders?filename=a.obj&budget=5&asset=again")
    first = service.services.jobs.files(job_id)
    problem(service.http.post(f"/v1/jobs/{job_id}/retry"), 409, "conflict")
    service.hand.begin()
    service.hand.fail()
    response = service.http.post(f"/v1/jobs/{job_id}/retry")
    new = response.json()
    assert response.status_code == 202
    assert response.headers["location"] == f"/v1/jobs/{new['id']}"
    assert (new["retry_of"], new["options"]["budget"], new["asset"]["name"]) == (job_id, 5, "again")
    assert service.services.jobs.files(new["id"]) == first
    service.hand.begin()
    service.hand.succeed()
    problem(service.http.post(f"/v1/jobs/{new['id']}/retry"), 409, "conflict")


def test_a_job_that_did_not_fail_is_not_retried(service):
    only = "only jobs that have failed or were cancelled can be retried"
    done = service.http.post(f"/v1/jobs/{service.done()}/retry")
    assert problem(done, 409, "conflict")["detail"] == f"the job has succeeded; {only}"
    job_id = service.queued()
    waits = service.http.post(f"/v1/jobs/{job_id}/retry")
    assert problem(waits, 409, "conflict")["detail"] == f"the job is queued; {only}"
    service.http.post(f"/v1/jobs/{job_id}/cancel")


def test_a_retry_that_is_sent_twice_is_one(service):
    job_id = service.queued(headers={"Idempotency-Key": "first"})
    service.http.post(f"/v1/jobs/{job_id}/cancel")
    retry = f"/v1/jobs/{job_id}/retry"
    ids = {
        key: [service.http.post(retry, headers={"Idempotency-Key": key}).json()["id"] for _ in "ab"]
        for key in ("second", "third")
    }
    assert all(len(set(same)) == 1 for same in ids.values())
    assert ids["second"] != ids["third"]
    again = service.http.post(retry, headers={"Idempotency-Key": "first"})
    problem(again, 422, "idempotency-key-reused")  # which is the key of the job itself
    problem(service.http.post(retry, headers={"Idempotency-Key": "a b"}), 422, "invalid-options")
    for one in (ids["second"][0], ids["third"][0]):
        service.http.post(f"/v1/jobs/{one}/cancel")


def test_a_job_whose_input_is_gone_is_not_done_again(service):
    job_id = service.queued()
    service.http.post(f"/v1/jobs/{job_id}/cancel")
    service.hand.blobs.path(service.services.jobs.files(job_id)[0].blob).unlink()
    told = problem(service.http.post(f"/v1/jobs/{job_id}/retry"), 409, "conflict")
    assert told["remedy"] == "send it again"


def test_what_there_is_not_is_told(service):
    for verb, path in (("GET", ""), ("POST", "/cancel"), ("POST", "/retry"), ("GET", "/events")):
        problem(service.http.request(verb, f"/v1/jobs/none{path}"), 404, "not-found")


def test_a_full_queue_says_when_to_come_again(tmp_path):
    with served(tmp_path, queue_limit=1) as small:
        small.queued()
        response = small.post(body=OBJ + b"# one too many\n")
        problem(response, 429, "queue-full")
        assert response.headers["retry-after"] == "5"


def test_a_full_queue_refuses_before_the_body_has_come(tmp_path):
    with served(tmp_path, queue_limit=1) as small:
        small.queued()
        place = urlsplit(str(small.http.base_url))
        with socket.create_connection((place.hostname, place.port), timeout=20.0) as client:
            head = (
                "POST /v1/occluders?filename=a.obj HTTP/1.1\r\n"
                f"Host: {place.netloc}\r\nContent-Length: {1 << 30}\r\n\r\n"
            )
            client.sendall(head.encode())
            assert client.recv(100).startswith(b"HTTP/1.1 429")


def test_a_key_that_gave_a_job_gives_it_again_though_the_queue_is_full(tmp_path):
    key = {"Idempotency-Key": "once"}
    with served(tmp_path, queue_limit=1) as small:
        first = small.post(headers=key)
        again = small.post(headers=key)
        assert (first.status_code, again.status_code) == (202, 202)
        assert again.json()["id"] == first.json()["id"]


@pytest.mark.parametrize(
    ("query", "changes", "kept"),
    [
        ("", {"error_bounds": [0.05, 0.1]}, {"lods": None, "error_bounds": [0.05, 0.1]}),
        ("error_bounds=0.05,0.1", {"lods": 2}, {"lods": 2, "error_bounds": None}),
        ("error_bounds=0.05,0.1", {"error_bounds": None}, {"lods": 3, "error_bounds": None}),
        ("error_bounds=0.05,0.1", {"resolution": 32}, {"lods": 3, "error_bounds": None}),
        ("resolution=32", {"error_share": 0.1}, {"resolution": None, "lods": 3}),
        ("time_limit=5", {"moves": 9}, {"time_limit": None, "moves": 9}),
        ("", {"conservative": True}, {"lods": None}),
        ("", {"shrink": 0.5}, {"lods": None}),
    ],
)
def test_an_option_that_is_given_replaces_its_rivals(service, query, changes, kept):
    job_id = service.done(f"/v1/occluders?filename=a.obj&budget=5&{query}")
    answer = service.http.post(f"/v1/jobs/{job_id}/rerun", json={"options": changes})
    assert answer.status_code == 202, answer.text
    options = answer.json()["options"]
    assert {name: options[name] for name in kept} == kept
    assert options["budget"] == 5
    service.http.post(f"/v1/jobs/{answer.json()['id']}/cancel")


@pytest.mark.parametrize(
    "changes",
    [{"lods": 2, "error_bounds": [0.1]}, {"lods": 3, "conservative": True},
     {"conservative": True}, {"shrink": "x"}],
)  # fmt: skip
def test_what_cannot_go_together_is_refused_where_both_were_asked_for(service, changes):
    job_id = service.done("/v1/occluders?filename=a.obj&lods=2")
    answer = service.http.post(f"/v1/jobs/{job_id}/rerun", json={"options": changes})
    problem(answer, 422, "invalid-options")


def test_a_job_is_run_again_with_other_options_and_the_same_input(service):
    job_id = service.done("/v1/occluders?filename=a.obj&budget=5&preset=draft&asset=rerun")
    place = f"/v1/jobs/{job_id}/rerun"
    response = service.http.post(place, json={"options": {"budget": 7}})
    new = response.json()
    assert (response.status_code, new["state"]) == (202, "queued")
    assert response.headers["location"] == f"/v1/jobs/{new['id']}"
    assert (new["options"]["budget"], new["options"]["preset"]) == (7, "draft")
    assert (new["asset"]["name"], new["retry_of"]) == ("rerun", None)
    sent = [file for file in service.services.jobs.files(job_id) if file.is_input]
    assert list(service.services.jobs.files(new["id"])) == sent
    same = service.http.post(place, json={"options": {}}).json()
    assert (same["state"], same["reused"]) == ("succeeded", job_id)
    told = problem(
        service.http.post(place, json={"options": {"budget": 0, "odd": 1}}), 422, "invalid-options"
    )
    assert {one["field"] for one in told["errors"]} == {"budget", "odd"}
    problem(service.http.post(place, json={"budget": 7}), 422, "invalid-options")
    service.hand.begin()
    service.hand.succeed()
