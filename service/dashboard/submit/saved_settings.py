"""Settings under names of one's own, kept by the browser."""

from __future__ import annotations

from nicegui import ui

from service.dashboard.notices import warn
from service.dashboard.submit.option_form import OptionForm
from service.dashboard.submit.remembered import Remembered
from service.dashboard.submit.typed import remembered_options
from service.schemas.options import OptionTable

_LONGEST = 80
_MOST = 50


class SavedSettings:
    """A choice of them, and the ways to save and to delete one.

    ``place``  that the browser keeps them under.
    """

    def __init__(self, form: OptionForm, table: OptionTable, place: str) -> None:
        self._form, self._table = form, table
        self._saved: dict[str, dict[str, str]] = {}
        with ui.element("div").classes("row-of-controls"):
            self._choice = ui.select([], label="Saved settings", on_change=self._use)
            self._choice.props("dense outlined options-dense").classes("saved-settings")
            ui.button("Save as", on_click=self._ask).props("no-caps flat")
            self._delete = ui.button("Delete", on_click=self._remove).props("no-caps flat")
        self._kept = Remembered(place, self._hear)
        with ui.dialog() as self._dialog, ui.card():
            ui.label("Save these settings").props("role=heading aria-level=2")
            self._name = ui.input("Name").props(f"dense outlined maxlength={_LONGEST}")
            self._name.props["hint"] = "This browser keeps them. A name that is there is replaced."
            self._name.on("keydown.enter", self._save)
            with ui.element("div").classes("row-of-controls"):
                ui.button("Save", on_click=self._save).props("no-caps unelevated")
                ui.button("Cancel", on_click=self._dialog.close).props("no-caps flat")
        self._show()

    def _hear(self, told: object) -> None:
        if isinstance(told, dict):
            self._saved = {
                str(name)[:_LONGEST]: remembered_options(self._table, values)
                for name, values in [*told.items()][:_MOST]
            }
        self._show()

    def _show(self, chosen: str | None = None) -> None:
        self._choice.set_options(sorted(self._saved), value=chosen)
        self._choice.set_enabled(bool(self._saved))
        self._delete.set_enabled(chosen is not None)

    def _use(self) -> None:
        name = self._choice.value
        self._delete.set_enabled(name is not None)
        if name in self._saved:
            self._form.reset()
            self._form.fill(self._saved[name])

    def _ask(self) -> None:
        self._name.value = self._choice.value or ""
        self._dialog.open()

    def _save(self) -> None:
        name = (self._name.value or "").strip()[:_LONGEST]
        if not name:
            warn("Give the settings a name")
            return
        if name not in self._saved and len(self._saved) >= _MOST:
            warn(f"There are {_MOST} saved settings already; delete one first")
            return
        self._saved[name] = self._form.typed
        self._kept.keep(self._saved)
        self._dialog.close()
        self._show(name)

    def _remove(self) -> None:
        self._saved.pop(self._choice.value or "", None)
        self._kept.keep(self._saved)
        self._show()
