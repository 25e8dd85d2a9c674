"""API keys, and the journal of who did what: for admins, of their own tenant."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, ConfigDict, Field

from service.routes.docs import EVERYWHERE, refusals
from service.routes.jobs import LARGEST_NUMBER, next_page
from service.routes.once import OnceRoute
from service.routes.services import KEYED, Admin, TheServices, address_of
from service.schemas.job import Moment
from service.schemas.key import (
    EntryBody,
    EntryPageBody,
    KeyBody,
    KeyListBody,
    NewKeyBody,
    WantedKey,
    WantedRotation,
)

router = APIRouter(prefix="/v1", tags=["keys"], dependencies=KEYED, route_class=OnceRoute)


@router.get("/keys", responses=refusals(*EVERYWHERE), summary="List keys")
def list_keys(services: TheServices, caller: Admin) -> KeyListBody:
    """All keys of the tenant, those that have ended too, in the order in which they were made."""
    return KeyListBody(items=[KeyBody.of(key) for key in services.keys.keys(caller.tenant)])


@router.post(
    "/keys",
    status_code=201,
    response_description="It was made.",
    responses=refusals(*EVERYWHERE, 413, 415, 507),
    summary="Make a key",
)
def make_key(
    wanted: WantedKey, request: Request, services: TheServices, caller: Admin
) -> NewKeyBody:
    """A key of the same tenant; its secret is in this answer and nowhere else."""
    key, secret = services.keys.create(
        caller.tenant,
        wanted.name,
        wanted.scope,
        expires=wanted.expires.timestamp() if wanted.expires else None,
        by=caller.at(address_of(request)),
    )
    return NewKeyBody.of(key, secret=secret)


@router.post(
    "/keys/{key_id}/rotate",
    status_code=201,
    response_description="The new key.",
    responses=refusals(*EVERYWHERE, 404, 409, 413, 415, 507),
    summary="Replace a key",
)
def rotate_key(
    key_id: str, wanted: WantedRotation, request: Request, services: TheServices, caller: Admin
) -> NewKeyBody:
    """A new key that may as much, at once; the old one goes on until the overlap ends."""
    done = services.keys.rotate(
        key_id,
        overlap=wanted.overlap,
        expires=wanted.expires.timestamp() if wanted.expires else None,
        tenant=caller.tenant,
        by=caller.at(address_of(request)),
    )
    return NewKeyBody.of(done.new, secret=done.secret)


@router.delete(
    "/keys/{key_id}",
    status_code=204,
    response_description="It has ended.",
    responses=refusals(*EVERYWHERE, 404, 409, 507),
    summary="Revoke a key",
)
def revoke_key(key_id: str, request: Request, services: TheServices, caller: Admin) -> None:
    """It and its sessions end within a second."""
    services.keys.revoke(key_id, tenant=caller.tenant, by=caller.at(address_of(request)))


class WantedEntries(BaseModel):
    """Which entries to list."""

    model_config = ConfigDict(extra="forbid")

    since: Moment | None = Field(None, description="Not older than this.")
    cursor: Annotated[int, Field(ge=1, le=LARGEST_NUMBER)] | None = Field(
        None, description="From `next` of the page before."
    )
    limit: int = Field(100, ge=1, le=500, description="Most entries of a page.")


@router.get("/journal", responses=refusals(*EVERYWHERE), summary="Who did what")
def list_journal(
    wanted: Annotated[WantedEntries, Query()], services: TheServices, caller: Admin
) -> EntryPageBody:
    """Keys made, rotated and revoked, sign-ins, thresholds set, assets removed: newest first."""
    page = services.journal.entries(
        caller.tenant,
        since=wanted.since.timestamp() if wanted.since else None,
        before=wanted.cursor,
        limit=wanted.limit,
    )
    return EntryPageBody(
        items=[EntryBody.of(entry) for entry in page.entries],
        next=next_page("/v1/journal", wanted, page.cursor),
    )
