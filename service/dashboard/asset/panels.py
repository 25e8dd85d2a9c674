"""All that there is to see of one run: a panel each, put together by :func:`run_panels`.

numbers      what came out, in a line
verdict      whether it is good for an engine, why, and what to try next
warnings     what the owner should know
levels       the levels of detail: how good each is, and from how far it may be used
histograms   how recall and precision spread over the views
timings      where the time went
solid        what the occluder had to stay within
pictures     the report's own picture of the silhouettes, the worst views first
downloads    every file of the job
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, get_args

from nicegui import ui

from service.dashboard.asset.details import RunDetail, Solid
from service.dashboard.asset.view_panels import viewer_panel, views_panel
from service.dashboard.colours import css
from service.dashboard.frame import folded, panel
from service.dashboard.lazy_chart import LazyChart
from service.dashboard.plain_table import PlainTable
from service.dashboard.views import Bin, Measure, View, histogram, quantile
from service.dashboard.wording import (
    VERDICT_CLASSES,
    distance_range,
    length,
    overhang,
    percent,
    seconds,
    whole,
)
from service.jobs.job import Summary
from service.jobs.on_demand import WHOLE
from service.keep import Keep
from service.schemas.result import LaterFile, Level, ResultFile

_BAR = (90, 130, 180)
_CLOSED_BY = {
    "ground": "the ground",
    "smallest_hole": "openings below the smallest hole",
    "sight": "what hardly any viewer sees",
}
_SHOWN = (".html", ".png", ".json")  # by the browser itself


def run_panels(
    run: RunDetail, holds: bool | None = None, *, beside: Callable[[], None] = lambda: None
) -> None:
    """Show a job that has succeeded; a scene has but numbers, times and files.

    ``beside``  makes what belongs below the numbers.
    """
    summary = run.job.summary
    assert summary is not None, "a job that has succeeded has a summary"
    if summary.verdict:
        verdict_panel(summary)
    numbers_panel(summary, holds)
    with ui.element("div").classes("row-of-controls"):
        if run.levels:
            download_button(run)
        beside()
    if summary.warnings:
        warnings_panel(summary.warnings)
    if run.views:
        with ui.element("div").classes("beside"):
            show = viewer_panel(run)
            views_panel(run.views, run.up, show)
    if run.levels:
        levels_panel(run)
    with ui.element("div").classes("run-panels"):
        if run.views:
            histograms_panel(run.views)
        timings_panel(summary.timings, summary.seconds)
        if run.solid:
            solid_panel(run.solid, run.deviation, summary.error_bound)
        if run.sheet:
            pictures_panel(run.sheet)
        downloads_panel(run.files, run.later, lean=run.job.keep is Keep.LEAN)


def download_button(run: RunDetail) -> None:
    """A menu of all as a zip, and of the levels in each format; single files are listed below."""
    files: tuple[ResultFile | LaterFile, ...] = (*run.files, *run.later)
    whole_files = {one.name: one.link for one in files if one.name in WHOLE}
    with ui.dropdown_button("Download").props('no-caps unelevated aria-label="Download"'):
        _menu_link("Everything, as a zip", run.zip)
        if len(run.levels) > 1:
            for name, link in whole_files.items():
                _menu_link(f"All levels, {name.rpartition('.')[2]}", link)
        for level in run.levels:
            which = f"Level {level.level}, {whole(level.triangles)} triangles, "
            for suffix, link in sorted(level.files.items()):
                _menu_link(f"{which if len(run.levels) > 1 else ''}{suffix}", link)


def _menu_link(text: str, address: str) -> None:
    item = ui.item(text).props("dense")
    item.props["href"] = address
    item.props["download"] = True
    item.props["role"] = "menuitem"


def numbers_panel(summary: Summary, holds: bool | None) -> None:
    """``holds``  whether it is good enough; None where nothing is demanded.

    What was not measured, as of a scene, is left out.
    """
    with ui.element("dl").classes("numbers"):
        if summary.recall is not None:
            show_number("Recall", percent(summary.recall))
        if summary.precision is not None:
            show_number("Precision", percent(summary.precision))
        if summary.worst_recall is not None:
            show_number("Worst view", percent(summary.worst_recall))
        if summary.overhang is not None:
            show_number("Overhang", overhang(summary.overhang))
        show_number("Triangles", f"{whole(summary.input_triangles)} to {whole(summary.triangles)}")
        show_number("Run time", seconds(summary.seconds))
        if holds is not None:
            words, look = ("met", "good") if holds else ("missed", "bad")
            show_number("Thresholds", words, look)


def show_number(name: str, value: str, look: str = "") -> None:
    """A figure in a line of numbers; ``look`` is a class of the style sheet."""
    with ui.element("div"):
        with ui.element("dt").classes("quiet"):
            ui.label(name)
        with ui.element("dd").classes(f"number {look}"):
            ui.label(value)


def verdict_panel(summary: Summary) -> None:
    """Say whether it is good for an engine, and why."""
    word, reason = summary.verdict or "", summary.reason or ""
    with ui.element("section").classes(f"panel engine-verdict {VERDICT_CLASSES.get(word, '')}"):
        ui.label(f"{word.capitalize()} for an engine").classes("panel-title").props(
            "role=heading aria-level=2"
        )
        ui.label(f"{reason[:1].upper()}{reason[1:]}.").classes("name")
        if summary.try_next:
            ui.label("Try next:").classes("quiet")
            with ui.element("pre").classes("command"):
                ui.label(summary.try_next)


def levels_panel(run: RunDetail) -> None:
    with panel("Levels of detail"):
        with ui.element("div").classes("scrolled wide-table"):
            _levels_table(run.levels)
        for sentence in run.left_out:
            ui.label(f"Left out {sentence}").classes("quiet")


def _levels_table(levels: Sequence[Level]) -> None:
    table = PlainTable(
        "Levels of detail, finest first",
        [
            "Level",
            "Verdict",
            "#Triangles",
            "#Recall",
            "#Precision",
            "#Overhang",
            "#Error bound",
            "#Distance",
            "Files",
        ],
    )
    starts = [level.switch_distance for level in levels]
    for level in levels:
        with table.row():
            table.heading(str(level.level))
            table.text(level.verdict or "-", VERDICT_CLASSES.get(level.verdict or "", "quiet"))
            table.number(whole(level.triangles))
            table.number(percent(level.recall))
            table.number(percent(level.precision))
            table.number(overhang(level.overhang))
            table.number(length(level.error_bound))
            table.number(distance_range(level.level, starts))
            with table.cell():
                _level_files(level)


def _level_files(level: Level) -> None:
    with ui.element("div").classes("links"):
        for suffix, link in sorted(level.files.items()):
            anchor = ui.link(suffix, link)
            anchor.props["download"] = True
            anchor.props["aria-label"] = f"Level {level.level} as .{suffix}"


def histograms_panel(views: Sequence[View]) -> None:
    """Show how the shares of all views spread; there is at least one view."""
    with panel("Spread over the views"):
        for measure in get_args(Measure):
            shares = [view.share(measure) for view in views]
            words = (
                f"{measure.capitalize()}: half of {len(shares)} views have "
                f"{percent(quantile(shares, 0.5))} or more, one in twenty less than "
                f"{percent(quantile(shares, 0.05))}, the worst "
                f"{percent(min(shares))}."
            )
            ui.label(words)
            chart = LazyChart(_histogram_options(histogram(shares)), f"Histogram. {words}")
            chart.classes("histogram")


def _histogram_options(bins: Sequence[Bin]) -> dict[str, Any]:
    return {
        "animation": False,
        "grid": {"left": 36, "right": 8, "top": 8, "bottom": 24},
        "tooltip": {"trigger": "axis", "confine": True},
        "xAxis": {
            "type": "category",
            "data": [f"{100.0 * one.low:g} to {100.0 * one.high:g} %" for one in bins],
            "axisTick": {"show": False},
        },
        "yAxis": {"type": "value", "minInterval": 1, "splitNumber": 3},
        "series": [
            {
                "type": "bar",
                "name": "views",
                "barCategoryGap": "8%",
                "itemStyle": {"color": css(_BAR)},
                "data": [one.count for one in bins],
            }
        ],
    }


def timings_panel(timings: Mapping[str, float], total: float) -> None:
    """Seconds by stage, in their order, and of the whole job."""
    with folded("Time by stage"):
        longest = max(timings.values(), default=0.0)
        table = PlainTable("Seconds by stage", ["Stage", "#Time", "Share of the longest"])
        for stage, taken in timings.items():
            with table.row():
                table.heading(stage)
                table.number(seconds(taken))
                with table.cell() as cell:
                    cell.classes("bar-cell")
                    share = taken / longest if longest > 0.0 else 0.0
                    ui.element("div").classes("bar-of-time").style(f"width: {100 * share:.1f}%")
        ui.label(f"The whole job took {seconds(total)}.").classes("quiet")


def solid_panel(solid: Solid, deviation: float | None, error_bound: float | None) -> None:
    """``deviation`` as measured and ``error_bound`` as promised, in the mesh's units."""
    with folded("The solid"):
        table = PlainTable("The solid that the occluder stays within", ["What", "Value"])
        rows = [
            ("Voxels", " x ".join(map(str, solid.cells))),
            ("Voxel size", length(solid.cell_size)),
            ("Inside, of the grid", percent(solid.inside)),
            *((f"Closed by {_CLOSED_BY.get(by, by)}", f"{length(volume)} added")
              for by, volume in solid.closed_by),
            ("Largest deviation found", length(deviation)),
            ("Error bound promised", length(error_bound)),
            *((f"Dropped triangles, {why.replace('_', ' ')}", f"{count:,}")
              for why, count in solid.dropped.items()),
        ]  # fmt: skip
        for name, value in rows:
            with table.row():
                table.heading(name)
                table.text(value)
        if not solid.closed_by:
            ui.label("No openings were closed. The mesh is used as it is.").classes("quiet")


def warnings_panel(warnings: Sequence[str]) -> None:
    """A sentence each, at least one."""
    with panel("Warnings"), ui.element("ul").classes("warnings"):
        for warning in warnings:
            with ui.element("li"):
                ui.label(warning).classes("name")


def pictures_panel(sheet: str) -> None:
    """``sheet`` is the address of the picture."""
    # Folded away: the picture weighs a sixth of the page, and the 3D view shows the same.
    with folded("Silhouettes of the report"), ui.link(target=sheet, new_tab=True) as larger:
        larger.props('aria-label="The silhouettes of the report as a picture of its own"')
        picture = ui.element("img").classes("sheet").props("loading=lazy")
        picture.props["src"] = sheet
        picture.props["alt"] = (
            "Silhouettes of original and occluder over each other from six directions, the worst "
            "first; yellow is hidden correctly, black missed, blue hidden wrongly"
        )


def downloads_panel(
    files: Sequence[ResultFile], later: Sequence[LaterFile] = (), *, lean: bool = False
) -> None:
    """``later``  what is made when somebody asks for it; ``lean`` where little was kept."""
    with panel("Downloads"):
        if lean:
            ui.label(
                "This job has kept its occluder and its report. The other files are made of them "
                "and of what was sent when they are first opened, and are kept from then on."
            ).classes("quiet")
        with ui.element("div").classes("scrolled"):
            _downloads(files, later)


def _downloads(files: Sequence[ResultFile], later: Sequence[LaterFile]) -> None:
    table = PlainTable("Files of the job", ["File", "#Size"])
    for file in files:
        with table.row():
            _download(table, file.name, file.link)
            table.number(file_size(file.size))
    for one in later:
        with table.row():
            _download(table, one.name, one.link)
            table.number("made when opened")


def _download(table: PlainTable, name: str, address: str) -> None:
    shown = name.endswith(_SHOWN)
    with table.cell():
        link = ui.link(name, address, new_tab=shown)
        if not shown:
            link.props["download"] = True


def file_size(count: int) -> str:
    """Bytes, in the largest unit that they fill."""
    for unit, worth in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= worth:
            return f"{count / worth:.1f} {unit}"
    return f"{count} B"
