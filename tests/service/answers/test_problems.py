"""Whatever fails is a problem, and no traceback leaves."""

from __future__ import annotations

import httpx
import pytest
from fastapi import FastAPI

from service.answers.problems import handle_failures
from service.errors import DatabaseDamagedError
from tests.service.routes.serving import problem


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
