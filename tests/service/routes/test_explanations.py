"""Every refusal is a problem that says what to do."""

from __future__ import annotations

import re

from service.routes.explanations import ADVICE, kinds
from tests.service.routes.serving import problem


def test_every_kind_of_problem_has_a_page_and_advice(service):
    slugs = {kind.slug for kind in kinds()}
    assert slugs == set(ADVICE)
    for kind in kinds():
        page = service.http.get(f"/problems/{kind.slug}")
        assert page.headers["content-type"].startswith("text/html")
        assert kind.title in page.text
    problem(service.http.get("/problems/none"), 404, "not-found")


def test_an_address_that_leads_nowhere_is_told(service):
    told = problem(service.http.get("/v2/jobs%22%0a"), 404, "not-found")
    assert told["remedy"] == "see /docs"
    assert told["instance"] == "/v2/jobs%22%0A"


def test_a_method_that_there_is_not_names_those_that_there_are(service):
    response = service.http.delete("/v1/jobs/x")
    told = problem(response, 405, "method-not-allowed")
    assert response.headers["allow"] == "GET"
    assert "GET" in told["remedy"]
    assert service.http.options("/v1/assets/x").headers["allow"] == "DELETE, GET"


def test_every_path_names_all_of_its_methods(service):
    """FastAPI keeps a router within a router to itself: what that held was left out here."""
    for path, operations in service.http.get("/openapi.json").json()["paths"].items():
        response = service.http.options(re.sub(r"{\w+}", "x", path))
        problem(response, 405, "method-not-allowed")
        assert response.headers["allow"] == ", ".join(sorted(map(str.upper, operations))), path
