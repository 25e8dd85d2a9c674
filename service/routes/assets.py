"""Assets: names with their runs, and what is demanded of them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service.access.authentication import demand_curator
from service.access.key import Caller, Scope
from service.errors import NotFoundError
from service.jobs.asset import Asset
from service.jobs.job import Job, JobKind
from service.routes.docs import EVERYWHERE, header, json_of, refusals
from service.routes.jobs import LARGEST_NUMBER, next_page
from service.routes.once import OnceRoute
from service.routes.services import (
    KEYED,
    Curator,
    Reader,
    Services,
    TheServices,
    Writer,
    address_of,
)
from service.schemas.asset import (
    AssetBody,
    AssetPageBody,
    Comparison,
    FolderThresholds,
    FolderThresholdsList,
    Name,
    NewAsset,
    NewName,
    Run,
    RunPageBody,
    ThresholdsBody,
)

router = APIRouter(prefix="/v1", tags=["assets"], dependencies=KEYED, route_class=OnceRoute)


class WantedAssets(BaseModel):
    """Which assets to list."""

    model_config = ConfigDict(extra="forbid")

    name: Name | None = Field(None, description="The one of this very name.")
    contains: str = Field("", max_length=300, description="With this in their name, in any case.")
    cursor: str | None = Field(
        None, pattern=r"^[0-9]{1,18}:[\s\S]{1,300}$", description="From `next` of the page before."
    )
    limit: int = Field(100, ge=1, le=500, description="Most assets of a page.")


class WantedRuns(BaseModel):
    """Which runs to list."""

    model_config = ConfigDict(extra="forbid")

    cursor: Annotated[int, Field(ge=1, le=LARGEST_NUMBER)] | None = Field(
        None, description="From `next` of the page before."
    )
    limit: int = Field(100, ge=1, le=500, description="Most runs of a page.")


@router.get("/assets", responses=refusals(*EVERYWHERE), summary="List assets")
def list_assets(
    wanted: Annotated[WantedAssets, Query()], services: TheServices, caller: Reader
) -> AssetPageBody:
    """Assets of yours by name, each with its latest run."""
    page = services.assets.assets(
        caller.tenant,
        name=wanted.name,
        contains=wanted.contains,
        after=wanted.cursor,
        limit=wanted.limit,
    )
    return AssetPageBody(
        items=[_asset_body(caller, one) for one in page.assets],
        next=next_page("/v1/assets", wanted, page.cursor),
    )


@router.put(
    "/assets",
    response_description="It was there already, and its thresholds are these now.",
    responses={
        201: {
            "description": "It was made.",
            "content": json_of("Asset"),
            "headers": {"Location": header("The asset.", required=True)},
        },
        **refusals(*EVERYWHERE, 413, 415, 507),
    },
    summary="Make an asset, or set its thresholds",
)
def put_asset(
    new: NewAsset, request: Request, response: Response, services: TheServices, caller: Writer
) -> AssetBody:
    """By name. Submitting with a new `asset` makes it too, without thresholds.

    What is demanded changes only by an admin's key.
    """
    asset, made = services.assets.put(
        caller.tenant,
        new.name,
        new.demands,
        by=caller.at(address_of(request)),
        before_change=lambda: demand_curator(caller),
    )
    if made:
        response.status_code = 201
        response.headers["Location"] = f"/v1/assets/{asset.id}"
    return _asset_body(caller, asset)


@router.get("/assets/{asset_id}", responses=refusals(*EVERYWHERE, 404), summary="Look at an asset")
def get_asset(asset_id: str, services: TheServices, caller: Reader) -> AssetBody:
    """The asset, its latest run, and whether that one is good enough."""
    return _asset_body(caller, services.assets.asset(caller.tenant, asset_id))


@router.delete(
    "/assets/{asset_id}",
    status_code=204,
    response_description="It is gone.",
    responses=refusals(*EVERYWHERE, 404, 409),
    summary="Remove an asset",
)
def delete_asset(asset_id: str, request: Request, services: TheServices, caller: Curator) -> None:
    """With all its jobs, by an admin's key. 409 while one of them has not ended."""
    services.assets.remove(caller.tenant, asset_id, by=caller.at(address_of(request)))


@router.put(
    "/assets/{asset_id}/thresholds",
    responses=refusals(*EVERYWHERE, 404, 413, 415, 507),
    summary="Set an asset's thresholds",
)
def put_thresholds(
    asset_id: str,
    thresholds: ThresholdsBody,
    request: Request,
    services: TheServices,
    caller: Curator,
) -> AssetBody:
    """What is demanded from now on, by an admin's key; what is left out or null is not."""
    asset = services.assets.set_thresholds(
        caller.tenant, asset_id, thresholds.demands, by=caller.at(address_of(request))
    )
    return _asset_body(caller, asset)


@router.put(
    "/assets/{asset_id}/name",
    responses=refusals(*EVERYWHERE, 404, 409, 413, 415, 507),
    summary="Rename an asset",
)
def put_name(
    asset_id: str, new: NewName, request: Request, services: TheServices, caller: Curator
) -> AssetBody:
    """By an admin's key; its runs stay its own. 409 where another asset has the name."""
    asset = services.assets.rename(
        caller.tenant, asset_id, new.name, by=caller.at(address_of(request))
    )
    return _asset_body(caller, asset)


@router.get(
    "/thresholds", responses=refusals(*EVERYWHERE), summary="List the thresholds of folders"
)
def list_thresholds(services: TheServices, caller: Reader) -> FolderThresholdsList:
    """Those that count for all assets in a folder which do not set them themselves."""
    found = services.assets.folder_thresholds(caller.tenant)
    return FolderThresholdsList(
        items=[FolderThresholds.at(path, found[path]) for path in sorted(found)]
    )


@router.put(
    "/thresholds",
    responses=refusals(*EVERYWHERE, 413, 415, 507),
    summary="Set a folder's thresholds",
)
def put_folder_thresholds(
    new: FolderThresholds, request: Request, services: TheServices, caller: Curator
) -> FolderThresholds:
    """From now on, by an admin's key; what is left out or null is up to the folder above."""
    services.assets.set_folder_thresholds(
        caller.tenant, new.folder, new.demands, by=caller.at(address_of(request))
    )
    return new


@router.get(
    "/assets/{asset_id}/runs", responses=refusals(*EVERYWHERE, 404), summary="List an asset's runs"
)
def list_runs(
    asset_id: str, wanted: Annotated[WantedRuns, Query()], services: TheServices, caller: Reader
) -> RunPageBody:
    """The history of precision and recall, newest first."""
    asset = services.assets.asset(caller.tenant, asset_id)
    page = services.assets.runs(caller.tenant, asset_id, before=wanted.cursor, limit=wanted.limit)
    return RunPageBody(
        items=[Run.of(job, asset.demanded) for job in page.runs],
        next=next_page(f"/v1/assets/{asset_id}/runs", wanted, page.cursor),
    )


class WantedComparison(BaseModel):
    """Which two runs to compare."""

    model_config = ConfigDict(extra="forbid")

    a: str | None = Field(None, description="Id of a job; unless given, the run before b.")
    b: str | None = Field(None, description="Id of a job; unless given, the latest run.")


@router.get(
    "/assets/{asset_id}/compare",
    responses=refusals(*EVERYWHERE, 404),
    summary="Compare two runs of an asset",
)
def compare_runs(
    asset_id: str,
    wanted: Annotated[WantedComparison, Query()],
    services: TheServices,
    caller: Reader,
) -> Comparison:
    """What changed in numbers, options and files: by default, from the run before to the latest."""
    asset = services.assets.asset(caller.tenant, asset_id)
    b = _run(services, asset, wanted.b) if wanted.b else asset.latest
    a = _run(services, asset, wanted.a) if wanted.a else _before(services, asset, b)
    if a is None or b is None:
        raise NotFoundError(
            f"the asset '{asset.name}' has no two runs to compare",
            remedy="name them by a and b, or make another run",
        )
    return Comparison.of(
        Run.of(a, asset.demanded),
        Run.of(b, asset.demanded),
        services.jobs.files(a.id),
        services.jobs.files(b.id),
    )


def _asset_body(caller: Caller, asset: Asset) -> AssetBody:
    return AssetBody.of(asset, whole_webhook=caller.may(Scope.WRITE))


def _run(services: Services, asset: Asset, job_id: str) -> Job:
    job = services.jobs.job(asset.tenant, job_id)
    if job.asset_id != asset.id or job.summary is None or job.kind is JobKind.TRADEOFF:
        raise NotFoundError(
            f"the job '{job_id}' is no run of '{asset.name}'", remedy="see the asset's 'runs'"
        )
    return job


def _before(services: Services, asset: Asset, run: Job | None) -> Job | None:
    if run is None:
        return None
    page = services.assets.runs(asset.tenant, asset.id, before=run.number, limit=1)
    return page.runs[0] if page.runs else None
