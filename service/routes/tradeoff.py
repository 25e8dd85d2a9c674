"""The kind of job that needs no upload: it is about the mesh of an asset's latest run."""

from __future__ import annotations

import math
from typing import Annotated, Any

from fastapi import APIRouter, Body
from fastapi.responses import Response

from service.jobs.job import JobKind
from service.routes import actions
from service.routes.docs import EVERYWHERE, NEW_JOB, refusals
from service.routes.jobs import job_body
from service.routes.once import OnceRoute
from service.routes.services import KEYED, TheServices, Writer
from service.schemas.job import JobBody
from service.schemas.job_options import option_tables

router = APIRouter(prefix="/v1", tags=["submit"], dependencies=KEYED, route_class=OnceRoute)

_SWEEP_SCHEMA = option_tables(math.inf, math.inf)[JobKind.TRADEOFF].schema()


@router.post(
    "/assets/{asset_id}/tradeoff",
    status_code=202,
    response_description="The job.",
    responses={202: NEW_JOB, **refusals(*EVERYWHERE, 404, 409, 413, 415, 507)},
    openapi_extra={
        "requestBody": {"content": {"application/json": {"schema": _SWEEP_SCHEMA}}},
    },
    summary="Measure speed against accuracy",
)
def measure_tradeoff(
    asset_id: str,
    options: Annotated[dict[str, Any], Body(description="What to measure.")],
    response: Response,
    services: TheServices,
    caller: Writer,
) -> JobBody:
    """Many settings on the mesh of the asset's latest run, each timed and judged.

    Results are `tradeoff.html` to read, and the rows as `tradeoff.csv` and `tradeoff.json`.
    """
    job = actions.sweep(services, caller, asset_id, options)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return job_body(services, caller, job)
