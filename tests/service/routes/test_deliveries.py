"""The log of webhooks, as its tenant sees it, and sending one again by hand."""

from __future__ import annotations

import pytest

from service.access.key import Scope
from service.jobs.deliveries import DeliveryAttempt
from tests.service.routes.serving import problem, served

HOOK = "https://ci.example.org/hooks/7f3a"
REFUSED = DeliveryAttempt(1_700_000_000.0, 41.5, 500, "the receiver answered 500", "no such hook")
HEARD = DeliveryAttempt(1_700_000_010.0, 12.0, 204)


def ended(service, **headers):
    """The id of a webhook whose job has ended just now."""
    path = f"/v1/occluders?filename=a.obj&webhook={HOOK}"
    job_id = service.queued(path, headers=headers)
    service.http.post(f"/v1/jobs/{job_id}/cancel", headers=headers).raise_for_status()
    listed = service.http.get(f"/v1/deliveries?job={job_id}", headers=headers)
    (one,) = listed.raise_for_status().json()["items"]
    assert one["job"] == f"/v1/jobs/{job_id}"
    return one["id"]


def under_way(service, delivery_id):
    (one,) = [one for one in service.deliveries.due(500) if one.id == delivery_id]
    return one


def test_each_try_is_told_with_its_answer(service):
    name = ended(service)
    service.deliveries.postpone(under_way(service, name), REFUSED, 0.0)
    service.deliveries.confirm(under_way(service, name), HEARD)
    told = service.http.get(f"/v1/deliveries/{name}").json()
    assert (told["state"], told["url"], told["due"], told["redelivered"]) == (
        "delivered", HOOK, None, 0,
    )  # fmt: skip
    first, second = told["attempts"]
    assert first == {
        "at": "2023-11-14T22:13:20Z", "milliseconds": 41.5, "status": 500,
        "reason": "the receiver answered 500", "excerpt": "no such hook",
    }  # fmt: skip
    assert (second["status"], second["reason"], second["excerpt"]) == (204, None, None)


def test_one_that_was_given_up_is_sent_again_by_hand(service):
    name = ended(service)
    service.deliveries.give_up(under_way(service, name), REFUSED)
    lost = service.http.get("/v1/deliveries?state=given_up").json()["items"]
    assert [one["id"] for one in lost] == [name]
    service.webhooks_woken.clear()
    answer = service.http.post(lost[0]["redeliver"])
    assert (answer.status_code, answer.json()["state"]) == (202, "waiting")
    assert answer.json()["redelivered"] == 1
    assert service.webhooks_woken.is_set()
    again = under_way(service, name)
    assert (again.id, again.attempt) == (name, 0)
    service.deliveries.confirm(again, HEARD)
    assert len(service.http.get(f"/v1/deliveries/{name}").json()["attempts"]) == 2


def test_the_log_comes_in_pages_newest_first(service):
    names = [ended(service) for _ in range(3)]
    first = service.http.get("/v1/deliveries?limit=2").json()
    assert [one["id"] for one in first["items"]] == [names[2], names[1]]
    assert service.http.get(first["next"]).json()["items"][0]["id"] == names[0]


@pytest.mark.parametrize(
    ("method", "path"), [("GET", "/v1/deliveries/none"), ("POST", "/v1/deliveries/none/redeliver")]
)
def test_what_is_not_there_is_a_problem(service, method, path):
    problem(service.http.request(method, path), 404, "not-found")


def test_a_tenant_sees_its_own_and_a_reader_neither_path_nor_answers(tmp_path):
    def headers(tenant, scope):
        return {"X-API-Key": service.keys.create(tenant, "", scope)[1]}

    with served(tmp_path, require_keys=True) as service:
        studio, other = (headers(one, Scope.WRITE) for one in ("studio", "other"))
        reader = headers("studio", Scope.READ)
        name = ended(service, **studio)
        service.deliveries.give_up(under_way(service, name), REFUSED)
        place = f"/v1/deliveries/{name}"
        assert service.http.get("/v1/deliveries", headers=other).json()["items"] == []
        problem(service.http.get(place, headers=other), 404, "not-found")
        problem(service.http.post(f"{place}/redeliver", headers=other), 404, "not-found")
        problem(service.http.post(f"{place}/redeliver", headers=reader), 403, "forbidden")
        told = service.http.get(place, headers=reader).json()
        assert told["url"] == "https://ci.example.org"
        assert told["attempts"][0]["status"] == 500
        assert told["attempts"][0]["excerpt"] is None
        assert service.http.get(place, headers=studio).json()["attempts"][0]["excerpt"]
