"""Every refusal is a problem that says what to do, and no traceback leaves."""

from __future__ import annotations

import httpx
import pytest
from fastapi import FastAPI

from service.answers.failures import handle_failures
from service.errors import DatabaseDamagedError
from service.routes.problems import ADVICE, kinds
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


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("error", "slug"),
    [(RuntimeError("a secret of ours"), "internal-error"),
     (DatabaseDamagedError("page 3 cannot be read"), "database-damaged")],
)  # fmt: skip
async def test_what_should_not_have_happened_is_a_problem_without_a_traceback(error, slug):
    app = FastAPI()
    handle_failures(app)

    @app.get("/broken")
    async def broken():
        raise error

    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with httpx.AsyncClient(transport=transport, base_url="http://here") as http:
        response = await http.get("/broken")
    problem(response, 500, slug)
    assert "secret" not in response.text


@pytest.fixture
def anyio_backend():
    return "asyncio"
