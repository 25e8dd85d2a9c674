"""New files with their settings, and the jobs that come of them.

The browser has the files, sends them, and keeps the settings from one visit to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from service.dashboard.asset.panels import file_size
from service.dashboard.jobs.live_job import LiveJob
from service.dashboard.links import keep_in_address
from service.dashboard.submit.intake import COMMON, Intake
from service.dashboard.submit.option_form import OptionForm
from service.dashboard.submit.remembered import Remembered
from service.dashboard.submit.saved_settings import SavedSettings
from service.dashboard.submit.typed import asset_names, remembered_options
from service.dashboard.visitor import Visitor

_LONGEST_NAME = 300
_FOLLOWED = 20
"""Jobs that are shown as they run; of more, the page of jobs tells."""

_FOLDERS = Path(__file__).parent / "folders"


class SubmitForm:
    """The panel of a submission, and below it a panel a job."""

    def __init__(self, visitor: Visitor, intake: Intake, asset: str = "") -> None:
        self._visitor = visitor
        self._files: list[str] = []
        self._table = visitor.services.tables[intake.kind]
        with ui.element("section").classes("panel"):
            self._uploader = Uploader(
                intake, visitor.services.settings.max_upload,
                on_chosen=self._hear_chosen, on_sent=self._hear_sent, on_done=self._hear_done,
            )  # fmt: skip
            self._asset = _asset_input(asset) if intake.assets else None
            kept = f"{intake.place.strip('/')}.{visitor.caller().tenant}"
            self._form = OptionForm(self._table, COMMON[intake.kind], on_change=self._keep)
            SavedSettings(self._form, self._table, f"{kept}.saved")
            with ui.element("div").classes("row-of-controls"):
                self._button = ui.button("Submit", on_click=self._submit)
                self._button.props("no-caps unelevated")
                ui.button("Defaults", on_click=self._reset).props("no-caps flat")
                words = ui.label(f"Choose {intake.one} first.")
                self._words = words.classes("quiet").props("role=status")
            self._button.disable()
        self._remembered = Remembered(kept, self._hear_kept)
        self._jobs = ui.element("div").classes("live-jobs")
        self._more = ui.label("").classes("quiet").props("role=status")
        self._sent = 0

    def _hear_chosen(self, names: list[str]) -> None:
        self._files = names
        self._button.set_enabled(bool(names))
        count = len(names)
        self._words.text = "" if count == 1 else f"{count} files" if count else ""

    def _submit(self) -> None:
        form = self._form.read()
        if form.faults:
            self._form.show_faults(form)
            return
        self._button.disable()
        self._words.text = "Sending"
        asset = self._asset.value or "" if self._asset else ""
        self._uploader.send(form.given, asset_names(asset, self._files))

    def _hear_sent(self, job_id: str) -> None:
        self._sent += 1
        if self._sent > _FOLLOWED:
            self._more.text = (
                f"{self._sent - _FOLLOWED} more jobs were submitted. Jobs lists all of them."
            )
            return
        with self._jobs:
            panel = LiveJob(self._visitor, job_id).panel
        panel.move(target_index=0)

    def _hear_done(self) -> None:
        self._button.set_enabled(bool(self._files))
        refused = len(self._files)
        self._words.text = "Some files could not be sent. See above." if refused else "Sent"

    def _hear_kept(self, told: object) -> None:
        self._form.fill(remembered_options(self._table, told))

    def _keep(self) -> None:
        """What is typed is there again after a reload, sent or not."""
        self._remembered.keep(self._form.typed)

    def _reset(self) -> None:
        self._form.reset()


def _asset_input(name: str) -> ui.input:
    entry = ui.input("Asset", value=name[:_LONGEST_NAME]).classes("asset-name")
    entry.props(f"dense outlined maxlength={_LONGEST_NAME} autocomplete=off")
    entry.on_value_change(lambda event: keep_in_address(asset=event.value or None))
    entry.props["hint"] = (
        "Name of the asset, such as props/castle. May stay empty. Several files become separate "
        "assets below this name."
    )
    return entry


class Uploader(Element, component="uploader.js", esm={"occluder-folders": str(_FOLDERS)}):
    """Files that wait to be sent are named by ``on_chosen``, each job that came of one by
    ``on_sent``; ``on_done`` follows the last."""

    def __init__(
        self,
        intake: Intake,
        largest: int,
        *,
        on_chosen: Callable[[list[str]], object],
        on_sent: Callable[[str], object],
        on_done: Callable[[], object],
    ) -> None:
        super().__init__()
        suffixes = intake.suffixes
        self.props["address"] = intake.address
        self.props["title"] = intake.title
        self.props["overrides"] = intake.overrides
        self.props["largest"] = largest
        self.props["accept"] = ",".join(suffixes + [".toml"] * intake.overrides)
        formats = ", ".join(one.removeprefix(".") for one in suffixes)
        self.props["help"] = (
            f"Choose or drop files ({formats}), or folders of them. Each file may have up to "
            f"{file_size(largest)}. "
            f"{intake.advice}"
        )

        def hear_chosen(event: GenericEventArguments) -> None:
            on_chosen([str(name) for name in event.args])

        def hear_sent(event: GenericEventArguments) -> None:
            on_sent(str(event.args["job"]))

        self.on("chosen", hear_chosen)
        self.on("sent", hear_sent)
        self.on("done", lambda: on_done())

    def send(self, settings: Sequence[tuple[str, str]], assets: Sequence[str]) -> None:
        """Send all that wait, each with the same settings and its asset's name."""
        self.run_method("send", [list(pair) for pair in settings], list(assets))
