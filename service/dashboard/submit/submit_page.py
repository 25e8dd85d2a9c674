"""The pages that take meshes or scenes in, or an earlier job's once more with other settings.

The second needs no upload: what was sent is stored with the job.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self

from anyio.to_thread import run_sync
from fastapi import Query
from nicegui import ui

from service.access.key import Scope
from service.dashboard.frame import page_frame
from service.dashboard.jobs.live_job import LiveJob
from service.dashboard.notices import showing_refusals, showing_unknown
from service.dashboard.submit.intake import COMMON, INTAKES, MESHES, SCENES, Intake
from service.dashboard.submit.option_form import OptionForm
from service.dashboard.submit.submit_form import SubmitForm
from service.dashboard.submit.typed import typed_options
from service.dashboard.visitor import Visitor, current_visitor
from service.jobs.job import OVERRIDES_FILE, Job, JobFile, JobKind
from service.routes import actions

_WHAT = {JobKind.SCENE: "scene", JobKind.VISIBILITY: "scene"}


@ui.page(MESHES.place)
async def submit_page(earlier: Annotated[str, Query(alias="from")] = "", asset: str = "") -> None:
    """``from`` is a job whose mesh is to be run again, ``asset`` the name to begin with."""
    visitor = current_visitor()
    if earlier:
        await _again(visitor, earlier)
        return
    _show(visitor, MESHES, asset)


@ui.page(SCENES.place)
async def submit_scenes_page() -> None:
    """For visible sets."""
    _show(current_visitor(), SCENES)


def _show(visitor: Visitor, intake: Intake, asset: str = "") -> None:
    with page_frame("Submit", here="/submit"):
        with ui.element("nav").props('aria-label="What to submit"').classes("places"):
            for one in INTAKES:
                link = ui.link(one.name, one.place).classes("place")
                if one is intake:
                    link.props('aria-current="page"')
        SubmitForm(visitor, intake, asset)


async def _again(visitor: Visitor, earlier: str) -> None:
    def find() -> Earlier:
        jobs = visitor.services.jobs
        job = jobs.job(visitor.caller().tenant, earlier)
        return Earlier.of(job, jobs.files(job.id))

    with showing_unknown():
        job = await run_sync(find)
        with page_frame("Run again", here="/submit"):
            AgainForm(visitor, job)


@dataclass(frozen=True)
class Earlier:
    """What is run again; ``overridden`` where overrides came with the mesh."""

    id: str
    kind: JobKind
    name: str
    asset: str | None
    options: Mapping[str, Any]
    overridden: bool

    @classmethod
    def of(cls, job: Job, files: Sequence[JobFile]) -> Self:
        overridden = any(file.name == OVERRIDES_FILE for file in files)
        return cls(job.id, job.kind, job.name, job.asset, job.options, overridden)


class AgainForm:
    """The panel, filled with the settings of the earlier job, and below it a panel a job."""

    def __init__(self, visitor: Visitor, earlier: Earlier) -> None:
        self._visitor, self._earlier = visitor, earlier
        table = visitor.services.tables[earlier.kind]
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("row-of-controls"):
                ui.label(f"The {_WHAT.get(earlier.kind, 'mesh')} of").classes("quiet")
                ui.link(earlier.name, f"/jobs/{earlier.id}").classes("name")
                if earlier.overridden:
                    ui.label("with").classes("quiet")
                    place = f"/v1/jobs/{earlier.id}/files/{OVERRIDES_FILE}"
                    ui.link("its overrides", place).props["download"] = True
                if earlier.asset:
                    ui.label("asset").classes("quiet")
                    ui.label(earlier.asset).classes("name")
            names = {one.name for one in table.fields}
            common = COMMON.get(earlier.kind, COMMON[JobKind.OCCLUDER])
            self._form = OptionForm(table, tuple(name for name in common if name in names))
            self._form.fill(typed_options(table, earlier.options))
            ui.button("Run again", on_click=self._run).props("no-caps unelevated")
        self._jobs = ui.element("div").classes("live-jobs")

    async def _run(self) -> None:
        form = self._form.read()
        if form.faults:
            self._form.show_faults(form)
            return

        def again() -> str:
            caller = self._visitor.caller(Scope.WRITE)
            return actions.rerun(self._visitor.services, caller, self._earlier.id, form.resolved).id

        with showing_refusals():
            job_id = await run_sync(again)
            with self._jobs:
                panel = LiveJob(self._visitor, job_id).panel
            panel.move(target_index=0)
