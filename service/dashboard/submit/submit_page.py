"""The page that takes meshes in, or an earlier job's mesh again."""

from __future__ import annotations

from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import Query
from nicegui import ui

from service.dashboard.frame import page_frame
from service.dashboard.submit.again import AgainForm, Earlier
from service.dashboard.submit.submit_form import COMMON, SubmitForm
from service.dashboard.unknown import unknown_told
from service.dashboard.visitor import Visitor, current_visitor


@ui.page("/submit")
async def submit_page(earlier: Annotated[str, Query(alias="from")] = "", asset: str = "") -> None:
    """``from`` is a job whose mesh is to be run again, ``asset`` the name to begin with."""
    visitor = current_visitor()
    if earlier:
        await _again(visitor, earlier)
        return
    with page_frame("Submit", here="/submit"):
        SubmitForm(visitor, asset)


async def _again(visitor: Visitor, earlier: str) -> None:
    def find() -> Earlier:
        jobs = visitor.services.jobs
        job = jobs.job(visitor.caller().tenant, earlier)
        return Earlier.of(job, jobs.files(job.id))

    with unknown_told():
        job = await run_sync(find)
        with page_frame("Run again", here="/submit"):
            AgainForm(visitor, job, COMMON)
