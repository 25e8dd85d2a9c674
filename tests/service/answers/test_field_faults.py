"""What pydantic refuses is told in the words of this service."""

from __future__ import annotations

import httpx
import pytest

from service.jobs.job import JobState
from tests.service.routes.serving import problem, served

LONG = "x" * 301
TIME = "give one such as 2026-01-31T12:00:00Z"
STATES = f"choose one of {', '.join(JobState)}"
OF_JOBS = "state, kind, asset, created_from, created_before, cursor, limit"
FOLLOW = "follow 'next' of the page before"


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    with served(tmp_path_factory.mktemp("data")) as one:
        yield one


def told(answer: httpx.Response) -> tuple[str, str, str]:
    body = problem(answer, 422, "invalid-options")
    assert body["title"] == "A field of the request is not valid"
    [fault] = body["errors"]
    return fault["field"], fault["detail"], fault["remedy"]


@pytest.mark.parametrize(
    ("address", "field", "detail", "remedy"),
    [
        ("jobs?limit=0", "limit", "0 is out of range", "choose 1 to 500"),
        ("jobs?limit=501", "limit", "501 is out of range", "choose 1 to 500"),
        ("jobs?limit=1.5", "limit", "'1.5' is not a whole number", "choose 1 to 500"),
        ("jobs?limit=ten", "limit", "'ten' is not a whole number", "choose 1 to 500"),
        ("deliveries?limit=500", "limit", "500 is out of range", "choose 1 to 200"),
        ("jobs?foo=bar", "foo", "there is no such field", f"choose from {OF_JOBS}"),
        ("jobs?state=foo", "state", "'foo' is not known", STATES),
        ("jobs?" + "state=queued&" * 6, "state", "6 values are given", "give at most 5"),
        ("jobs?cursor=abc", "cursor", "'abc' is no cursor of this list", FOLLOW),
        ("jobs?cursor=0", "cursor", "'0' is no cursor of this list", FOLLOW),
        ("assets?cursor=abc", "cursor", "'abc' is no cursor of this list", FOLLOW),
        ("journal?since=5", "since", "'5' is no time with an offset from UTC", TIME),
        (
            "jobs?created_from=2024-01-01T00:00:00", "created_from",
            "'2024-01-01T00:00:00' is no time with an offset from UTC", TIME,
        ),
        (
            "assets?contains=" + LONG, "contains", "it has 301 characters",
            "give 0 to 300 characters",
        ),
        ("assets?name=%20a", "name", "it begins or ends with a space", "choose another"),
        ("jobs/x/picture?n=x", "n", "'x' is not a whole number", "give a whole number"),
        (
            "jobs/x/files/y?redirect=maybe", "redirect", "'maybe' is neither true nor false",
            "give true or false",
        ),
    ],
)  # fmt: skip
def test_of_a_query(service, address, field, detail, remedy):
    assert told(service.http.get(f"/v1/{address}")) == (field, detail, remedy)


@pytest.mark.parametrize(
    ("address", "body", "field", "detail", "remedy"),
    [
        ("PUT assets", {}, "name", "it is missing", "give 1 to 300 characters"),
        ("PUT assets", {"name": ""}, "name", "it has 0 characters", "give 1 to 300 characters"),
        ("PUT assets", {"name": None}, "name", "null is not text", "give 1 to 300 characters"),
        ("PUT assets", {"name": ["a"]}, "name", "a list is not text", "give 1 to 300 characters"),
        (
            "PUT assets", {"name": "a", "colour": 1}, "colour", "there is no such field",
            "choose from min_precision, min_recall, max_overhang, name",
        ),
        (
            "PUT assets", {"name": "a", "min_recall": 1.5}, "min_recall", "1.5 is out of range",
            "choose 0 to 1",
        ),
        (
            "PUT assets", {"name": "a", "min_recall": "0.5"}, "min_recall",
            "'0.5' is not a number", "choose 0 to 1",
        ),
        (
            "PUT assets", {"name": "a", "min_recall": True}, "min_recall", "true is not a number",
            "choose 0 to 1",
        ),
        ("PUT assets", [], "body", "a list is not a JSON object", "send a JSON object"),
        ("PUT assets", 5, "body", "5 is not a JSON object", "send a JSON object"),
        ("POST assets/x/tradeoff", "x", "body", "'x' is not a JSON object", "send a JSON object"),
        ("POST jobs/x/rerun", {}, "options", "it is missing", "send a JSON object"),
        (
            "POST jobs/x/rerun", {"options": []}, "options", "a list is not a JSON object",
            "send a JSON object",
        ),
        (
            "POST keys", {"scope": "root"}, "scope", "'root' is not known",
            "choose one of read, write, admin",
        ),
        (
            "POST keys", {"name": "a\nb"}, "name",
            "a name has at most 100 characters, and none that cannot be printed", "choose another",
        ),
        ("POST keys", {"name": ""}, "name", "it has 0 characters", "give 1 to 100 characters"),
        ("POST keys", {"name": " "}, "name", "nothing of it can be seen", "choose another"),
        (
            "POST keys", {"expires": 5}, "expires", "5 is no time with an offset from UTC", TIME,
        ),
        (
            "POST keys/x/rotate", {"overlap": -1}, "overlap", "-1 is out of range",
            "choose 0 to 7,776,000",
        ),
    ],
)  # fmt: skip
def test_of_a_body(service, address, body, field, detail, remedy):
    method, _, path = address.partition(" ")
    answer = service.http.request(method, f"/v1/{path}", json=body)
    assert told(answer) == (field, detail, remedy)


def test_a_body_that_does_not_come_is_missing(service):
    assert told(service.http.put("/v1/assets")) == ("body", "it is missing", "send a JSON object")


def test_a_long_value_is_cut(service):
    _, detail, _ = told(service.http.put("/v1/assets", json={"name": "a", "min_recall": LONG}))
    assert detail == f"'{'x' * 56}... is not a number"
