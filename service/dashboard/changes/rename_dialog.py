"""A dialog that gives an asset another name."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from service.dashboard.names import show_name
from service.dashboard.notices import showing_refusals, tell
from service.dashboard.visitor import Visitor
from service.jobs.asset import LONGEST_NAME, asset_name


def open_rename(
    visitor: Visitor, asset_id: str, name: str, on_renamed: Callable[[], Awaitable[None]]
) -> None:
    """Opens at once."""
    with ui.dialog(value=True) as dialog, ui.card().classes("dialog-card"):
        dialog.props('aria-label="Rename"').on("hide", dialog.delete)
        ui.label("Rename").classes("panel-title").props("role=heading aria-level=2")
        with ui.element("div").classes("name quiet"):
            show_name(name)
        field = ui.input("New name", value=name, validation=_fault).without_auto_validation()
        field.props(f"dense outlined autofocus autocomplete=off maxlength={LONGEST_NAME}")
        ui.label(
            "The asset keeps its runs. Scripts and builds that submit under the old name make a "
            "new asset."
        ).classes("quiet dialog-words")

        async def save() -> None:
            if not field.validate():
                return

            def store() -> None:
                caller = visitor.curator()
                by = caller.at(visitor.address)
                wanted = asset_name(field.value)
                visitor.services.assets.rename(caller.tenant, asset_id, wanted, by=by)

            with showing_refusals():
                await run.io_bound(store)
                dialog.close()
                tell("Renamed")
                await on_renamed()

        field.on("keydown.enter", save)
        with ui.element("div").classes("row-of-controls"):
            ui.button("Rename", on_click=save).props("no-caps unelevated")
            ui.button("Cancel", on_click=dialog.close).props("no-caps flat")


def _fault(name: str | None) -> str | None:
    """What is wrong with a name, in a sentence."""
    try:
        asset_name(name or "")
    except ValueError as error:
        told = str(error)
        return f"This name cannot be used: {told}."
    return None
