"""Webhooks: the log of what came of them, and sending one again by hand."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field

from service.access.key import Caller, Scope
from service.jobs.deliveries import DeliveryFilter, DeliveryRecord, DeliveryState
from service.routes.docs import EVERYWHERE, refusals
from service.routes.jobs import LARGEST_NUMBER, next_page
from service.routes.once import OnceRoute
from service.routes.services import KEYED, Reader, TheServices, Writer
from service.schemas.delivery import DeliveryBody, DeliveryPageBody

router = APIRouter(prefix="/v1", tags=["webhooks"], dependencies=KEYED, route_class=OnceRoute)


class WantedDeliveries(BaseModel):
    """Which webhooks to list."""

    model_config = ConfigDict(extra="forbid")

    state: DeliveryState | None = Field(None, description="One state.")
    job: str | None = Field(None, description="Id of a job.")
    cursor: Annotated[int, Field(ge=1, le=LARGEST_NUMBER)] | None = Field(
        None, description="From `next` of the page before."
    )
    limit: int = Field(50, ge=1, le=200, description="Most webhooks of a page.")


@router.get("/deliveries", responses=refusals(*EVERYWHERE), summary="List webhooks")
def list_deliveries(
    wanted: Annotated[WantedDeliveries, Query()], services: TheServices, caller: Reader
) -> DeliveryPageBody:
    """Webhooks of jobs of yours that have ended, newest first, each with its tries."""
    page = services.deliveries.page(
        caller.tenant,
        DeliveryFilter(state=wanted.state, job_id=wanted.job),
        before=wanted.cursor,
        limit=wanted.limit,
    )
    return DeliveryPageBody(
        items=[_body(caller, record) for record in page.records],
        next=next_page("/v1/deliveries", wanted, page.cursor),
    )


@router.get(
    "/deliveries/{delivery_id}", responses=refusals(*EVERYWHERE, 404), summary="Look at a webhook"
)
def get_delivery(delivery_id: str, services: TheServices, caller: Reader) -> DeliveryBody:
    """The webhook, and what came of each try."""
    return _body(caller, services.deliveries.record(caller.tenant, delivery_id))


@router.post(
    "/deliveries/{delivery_id}/redeliver",
    status_code=202,
    response_description="The webhook, which waits to be sent.",
    responses=refusals(*EVERYWHERE, 404, 507),
    summary="Send a webhook again",
)
def redeliver(delivery_id: str, services: TheServices, caller: Writer) -> DeliveryBody:
    """At once, whatever became of it, and with all its tries. Its id stays the same, so that a
    receiver that has dealt with it passes it over."""
    record = services.deliveries.redeliver(caller.tenant, delivery_id)
    services.answers.afterwards(services.wake_webhooks)
    return _body(caller, record)


def _body(caller: Caller, record: DeliveryRecord) -> DeliveryBody:
    return DeliveryBody.of(record, whole=caller.may(Scope.WRITE))
