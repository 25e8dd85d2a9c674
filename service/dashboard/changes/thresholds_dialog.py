"""A dialog to say what is demanded of the runs of an asset, or of all assets in a folder."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass

from nicegui import run, ui

from service.access.key import Caller
from service.dashboard.names import show_name
from service.dashboard.notices import showing_refusals, tell
from service.dashboard.visitor import Visitor
from service.dashboard.wording import exact_percent
from service.jobs.asset import PROJECT, Thresholds, demanded


@dataclass(frozen=True)
class Subject:
    """What thresholds are set of.

    ``name``   of the asset, or the path of the folder; ``asset_id`` is None for a folder.
    ``own``    its own thresholds; ``folders`` those of all folders.
    """

    name: str
    asset_id: str | None
    own: Thresholds
    folders: Mapping[str, Thresholds]

    @property
    def title(self) -> str:
        if self.asset_id is not None:
            return self.name
        return folder_words(self.name)

    @property
    def above(self) -> Thresholds:
        """What counts for what it does not set itself."""
        return demanded(Thresholds(), self.name, self.folders)


def folder_words(path: str) -> str:
    """A folder as people call it."""
    return "All assets" if path == PROJECT else f"{path}/"


def open_thresholds(
    visitor: Visitor, subject: Subject, on_saved: Callable[[], Awaitable[None]]
) -> None:
    """Opens at once.  What is left empty is up to the folder above."""
    with ui.dialog(value=True) as dialog, ui.card().classes("dialog-card"):
        dialog.props('aria-label="Thresholds"').on("hide", dialog.delete)
        ui.label("Thresholds").classes("panel-title").props("role=heading aria-level=2")
        with ui.element("div").classes("name quiet"):
            show_name(subject.title)
        above = subject.above
        recall = _share("Minimum recall", subject.own.min_recall, above.min_recall)
        recall.props("autofocus")
        precision = _share("Minimum precision", subject.own.min_precision, above.min_precision)
        overhang = _share("Maximum overhang", subject.own.max_overhang, above.max_overhang)
        ui.label(_rest_words(subject)).classes("quiet dialog-words")

        async def save() -> None:
            fields = (precision, recall, overhang)
            if not all(one.validate() for one in fields):
                return
            wanted = Thresholds(*(_of_percent(one.value) for one in fields))
            with showing_refusals():
                await run.io_bound(_store, visitor, subject, wanted)
                dialog.close()
                tell("Thresholds saved")
                await on_saved()

        with ui.element("div").classes("row-of-controls"):
            ui.button("Save", on_click=save).props("no-caps unelevated")
            ui.button("Cancel", on_click=dialog.close).props("no-caps flat")


def _store(visitor: Visitor, subject: Subject, wanted: Thresholds) -> None:
    caller: Caller = visitor.curator()
    assets, by = visitor.services.assets, caller.at(visitor.address)
    if subject.asset_id is None:
        assets.set_folder_thresholds(caller.tenant, subject.name, wanted, by=by)
    else:
        assets.set_thresholds(caller.tenant, subject.asset_id, wanted, by=by)


def _rest_words(subject: Subject) -> str:
    if subject.asset_id is None and subject.name == PROJECT:
        return "They apply to every asset that does not set its own. Empty fields set no limit."
    if subject.asset_id is None:
        return "They apply to every asset in the folder that does not set its own."
    return "Empty fields take the limit of the folder. To switch a minimum off, enter 0."


def _share(label: str, share: float | None, above: float | None) -> ui.number:
    field = ui.number(
        label,
        value=None if share is None else round(100.0 * share, 6),
        min=0,
        max=100,
        step=0.1,
        suffix="%",
        validation={"Enter 0 to 100": lambda value: value is None or 0 <= value <= 100},
    ).props("dense outlined clearable stack-label")
    field.props["placeholder"] = "no limit" if above is None else f"{100.0 * above:.6g}"
    return field


def _of_percent(value: float | None) -> float | None:
    return None if value is None else value / 100.0


def thresholds_words(thresholds: Thresholds) -> str:
    """All that is demanded, in a sentence."""
    pairs = (
        ("recall at least", thresholds.min_recall),
        ("precision at least", thresholds.min_precision),
        ("overhang at most", thresholds.max_overhang),
    )
    asked = [f"{name} {exact_percent(limit)}" for name, limit in pairs if limit is not None]
    return f"Thresholds: {', '.join(asked)}." if asked else "No thresholds set."
