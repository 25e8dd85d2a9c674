"""Whatever changes something is done once under an Idempotency-Key, by real HTTP."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count

import pytest

from service.access.key import Scope
from tests.service.routes.serving import OBJ, problem, served

_NUMBERS = count()


def fresh():
    return {"Idempotency-Key": f"once-{next(_NUMBERS)}"}


@contextmanager
def posted_twice(work, name, send):
    """What two at once are answered; the second comes while the first is at ``work.name``."""
    begun, go_on, real = threading.Event(), threading.Event(), getattr(work, name)

    def slow(*given, **named):
        begun.set()
        assert go_on.wait(10.0)
        return real(*given, **named)

    setattr(work, name, slow)
    try:
        with ThreadPoolExecutor(1) as others:
            first = others.submit(send)
            assert begun.wait(10.0)
            second = send()
            go_on.set()
            yield first.result(), second
    finally:
        go_on.set()
        delattr(work, name)


def test_every_route_that_changes_something_takes_a_key(service):
    document = service.http.get("/openapi.json").json()
    changing = [
        (path, method, operation)
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
        if method not in ("get", "head")
    ]
    assert len(changing) >= 13
    for path, method, operation in changing:
        names = [one["name"] for one in operation["parameters"]]
        assert names.count("Idempotency-Key") == 1, (path, method)
        assert {"409", "422"} <= set(operation["responses"]), (path, method)


def put_asset(service, asset):
    return "PUT", "/v1/assets", {"name": "another", "min_recall": 0.5}


def set_thresholds(service, asset):
    return "PUT", f"/v1/assets/{asset}/thresholds", {"min_recall": 0.25}


def remove_asset(service, asset):
    return "DELETE", f"/v1/assets/{asset}", None


def cancel(service, asset):
    return "POST", f"/v1/jobs/{service.queued()}/cancel", None


def retry(service, asset):
    job_id = service.queued()
    service.http.post(f"/v1/jobs/{job_id}/cancel")
    return "POST", f"/v1/jobs/{job_id}/retry", None


def rerun(service, asset):
    return "POST", f"/v1/jobs/{service.queued()}/rerun", {"options": {"budget": 3}}


def sweep(service, asset):
    return "POST", f"/v1/assets/{asset}/tradeoff", {}


def revoke(service, asset):
    key, _ = service.keys.create("local", "ci", Scope.READ)
    return "DELETE", f"/v1/keys/{key.id}", None


@pytest.mark.parametrize(
    "change", [put_asset, set_thresholds, remove_asset, cancel, retry, rerun, sweep, revoke]
)
def test_sent_again_it_is_answered_as_it_was(tmp_path, change):
    with served(tmp_path) as service:
        job_id = service.done("/v1/occluders?filename=a.obj&asset=tower")
        asset = service.services.jobs.job(None, job_id).asset_id
        method, path, body = change(service, asset)
        key = fresh()

        def send(**more):
            return service.http.request(method, path, headers=key, json=body, **more)

        def state():
            journal = service.services.journal.entries(None, limit=500).entries
            jobs = service.http.get("/v1/jobs?limit=500").json()["items"]
            return journal, jobs, service.http.get("/v1/assets").json()

        first = send()
        assert first.is_success, first.text
        assert "idempotent-replayed" not in first.headers
        before = state()
        again = send()
        assert (again.status_code, again.content) == (first.status_code, first.content)
        assert again.headers["idempotent-replayed"] == "true"
        for name in ("location", "content-type"):
            assert again.headers.get(name) == first.headers.get(name)
        assert state() == before
        problem(send(params={"other": "1"}), 422, "idempotency-key-reused")
        other = service.http.put("/v1/assets", headers=key, json={"name": "a third"})
        problem(other, 422, "idempotency-key-reused")
        assert state() == before


def test_a_key_that_is_made_is_made_once_and_its_secret_kept_nowhere(tmp_path):
    with served(tmp_path) as service:
        key, body = fresh(), {"name": "ci"}
        first = service.http.post("/v1/keys", json=body, headers=key)
        again = service.http.post("/v1/keys", json=body, headers=key)
        assert (first.status_code, again.status_code) == (201, 201)
        made = first.json()
        assert service.keys.find(made["secret"]).id == made["id"]
        assert again.json() == {**made, "secret": None}
        place, key = f"/v1/keys/{made['id']}/rotate", fresh()
        turned, repeated = (service.http.post(place, json={}, headers=key) for _ in "ab")
        assert repeated.json() == {**turned.json(), "secret": None}
        assert len(service.http.get("/v1/keys").json()["items"]) == 2
        for file in tmp_path.glob("occluder.db*"):
            for one in (made, turned.json()):
                assert one["secret"][8:].encode() not in file.read_bytes()


def test_an_upload_that_is_sent_again_is_answered_as_it_was(service):
    key, path = fresh(), "/v1/occluders?filename=a.obj&budget=41"
    first = service.post(path, headers=key)
    assert first.status_code == 202
    service.hand.begin()
    again = service.post(path, headers=key)
    assert (again.status_code, again.content) == (202, first.content)
    assert again.headers["location"] == first.headers["location"]
    assert again.headers["idempotent-replayed"] == "true"
    parts = service.http.post(
        "/v1/occluders?budget=41", files={"mesh": ("a.obj", OBJ)}, headers=key
    )
    assert parts.content == first.content  # however it was sent
    service.hand.succeed()
    waited = service.post(path, headers={**key, "Prefer": "wait=5"})
    assert (waited.status_code, waited.headers["idempotent-replayed"]) == (200, "true")
    assert waited.json()["job"]["id"] == first.json()["id"]


def test_an_upload_whose_result_was_stored_is_told_by_it_again(service):
    path = "/v1/occluders?filename=a.obj&budget=43"
    service.post(path)
    service.hand.begin()
    service.hand.succeed()
    key = {**fresh(), "Accept": "model/obj"}
    first, again = (service.post(path, headers=key) for _ in "ab")
    assert (first.status_code, again.status_code) == (200, 200)
    assert first.content == again.content
    assert first.headers["location"] == again.headers["location"]
    assert again.headers["idempotent-replayed"] == "true"


def test_a_full_queue_gives_the_answer_that_it_gave(tmp_path):
    with served(tmp_path, queue_limit=1) as service:
        key = fresh()
        first = service.post(headers=key)
        problem(service.post(headers=fresh()), 429, "queue-full")
        assert service.post(headers=key).content == first.content


def test_what_was_refused_is_judged_anew(service):
    key, job_id = fresh(), service.queued()
    retry = f"/v1/jobs/{job_id}/retry"
    problem(service.http.post(retry, headers=key), 409, "conflict")
    service.http.post(f"/v1/jobs/{job_id}/cancel")
    done = service.http.post(retry, headers=key)
    assert done.status_code == 202
    service.http.post(done.json()["links"]["cancel"])


def test_another_tenants_key_is_another(tmp_path):
    with served(tmp_path, require_keys=True) as service:
        key, body, made = fresh(), {"name": "gate"}, set()
        for tenant in ("ours", "theirs"):
            _, secret = service.keys.create(tenant, "ci", Scope.WRITE)
            headers = {**key, "X-API-Key": secret}
            answer = service.http.put("/v1/assets", json=body, headers=headers)
            assert answer.status_code == 201
            made.add(answer.json()["id"])
        assert len(made) == 2


def test_of_two_at_once_the_second_is_told_that_the_first_is_worked_on(service):
    key, body = fresh(), {"name": "at once"}

    def send():
        return service.http.put("/v1/assets", json=body, headers=key)

    with posted_twice(service.services.assets, "put", send) as (first, second):
        assert first.status_code == 201
        problem(second, 409, "request-under-way")
        assert second.headers["retry-after"] == "1"
    again = send()
    assert (again.status_code, again.content) == (201, first.content)


def test_of_two_uploads_at_once_one_makes_the_job(service):
    key = fresh()

    def send():
        return service.post("/v1/occluders?filename=a.obj&budget=47", headers=key)

    with posted_twice(service.services.jobs, "submit", send) as (first, second):
        assert first.status_code == 202
        problem(second, 409, "request-under-way")
    assert send().json()["id"] == first.json()["id"]
    service.http.post(first.json()["links"]["cancel"])


def test_many_at_once_change_one_thing_once(service):
    for send in (
        lambda key: service.post("/v1/occluders?filename=a.obj&budget=53", headers=key),
        lambda key: service.http.post("/v1/keys", json={"name": "many"}, headers=key),
    ):
        key, at_once = fresh(), threading.Barrier(8)

        def one(_, send=send, key=key, at_once=at_once):
            at_once.wait(10.0)
            return send(key)

        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(one, range(8)))
        done = [one for one in answers if one.is_success]
        assert len({one.json()["id"] for one in done}) == 1
        assert [one.headers.get("idempotent-replayed") for one in done].count(None) == 1
        for late in answers:
            if late not in done:
                problem(late, 409, "request-under-way")
    many = [one for one in service.http.get("/v1/keys").json()["items"] if one["name"] == "many"]
    assert len(many) == 1
