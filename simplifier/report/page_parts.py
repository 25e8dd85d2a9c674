"""The pieces of the HTML page about an occluder; each takes plain values and escapes them."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from simplifier.wording import direction, length, percent, seconds

if TYPE_CHECKING:
    from simplifier.report.silhouettes import ViewPicture

Report = Mapping[str, Any]
Rows = Sequence[tuple[str, str]]


def summary(report: Report) -> str:
    """One line: what came of what, and how sure that is."""
    bound = report["error_bound"]
    within = "" if bound is None else f", at most {length(bound)} units from the original"
    return (
        f"{report['input']['triangles']:,} triangles in, {report['triangles']:,} out{within}. "
        f"Judged from {len(report['by_view']):,} directions."
    )


def warnings(warnings: Sequence[str]) -> str:
    """A box that cannot be overlooked, or nothing."""
    if not warnings:
        return ""
    items = "".join(f"<li>{escape(str(warning))}</li>" for warning in warnings)
    return f'<section class="warnings" role="alert"><b>Please note</b><ul>{items}</ul></section>'


def tiles(report: Report) -> str:
    """The headline figures."""
    worst = report["worst_view"]
    tiles = [
        ("Recall", percent(report["recall"]), "of what could be hidden is hidden"),
        ("Precision", percent(report["precision"], 2), "of what is hidden is hidden rightly"),
        ("Worst view", percent(worst["recall"]), f"recall along {direction(worst['direction'])}"),
        ("Triangles", f"{report['triangles']:,}", f"from {report['input']['triangles']:,}"),
        ("Occlusion kept", percent(report["occlusion_measure"]["ratio"]), "of the total measure"),
        ("Error bound", length(report["error_bound"]), "units, the most that is allowed"),
        ("Deviation", length(report["deviation"]), "units, the most that was found"),
    ]
    return "".join(
        f"<div><dt>{escape(label)}</dt><dd>{escape(value)}<small>{escape(note)}</small></dd></div>"
        for label, value, note in tiles
    )


def view(view: ViewPicture, data: bytes) -> str:
    """One silhouette with its caption."""
    worst = ' class="worst"' if view.name.startswith("worst") else ""
    figures = f"recall {percent(view.recall)}, precision {percent(view.precision, 2)}"
    along = f"seen along {direction(view.direction)}"
    caption = f"<b{worst}>{escape(view.name.capitalize())}</b>{escape(figures)}<br>{escape(along)}"
    return _figure(data, f"Silhouettes, {view.name}: {figures}, {along}", caption)


def histograms(report: Report, recall: bytes, precision: bytes) -> str:
    """Both histograms, their ranges in words for who cannot see them."""
    both = [("recall", recall), ("precision", precision)]
    return "".join(_figure(data, _spread(report, key), "") for key, data in both)


def _spread(report: Report, key: str) -> str:
    values = [view[key] for view in report["by_view"]]
    return f"Histogram of {key} by view, from {percent(min(values))} to {percent(max(values))}"


def _figure(data: bytes, description: str, caption: str) -> str:
    source = "data:image/png;base64," + base64.b64encode(data).decode("ascii")
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    return f'<figure><img src="{source}" alt="{escape(description)}">{below}</figure>'


def timings(timings: Mapping[str, float]) -> str:
    """Seconds by stage, with bars; stages that did not run are left out."""
    longest = max([*timings.values(), 1e-9])
    rows = [
        f"<tr><th scope=row>{escape(stage)}</th><td>{seconds(time)}</td>"
        f'<td><span class="bar" style="width: {100.0 * time / longest:.2f}%"></span></td></tr>'
        for stage, time in timings.items()
        if time > 0.0
    ]
    total = f"<th scope=row>total</th><td>{seconds(sum(timings.values()))}</td><td></td>"
    return f'<table class="timings">{"".join(rows)}<tr class="total">{total}</tr></table>'


def facts(report: Report) -> list[str]:
    """Tables about the input, the solid and the options."""
    return [
        _table("Input", _input_rows(report["input"])),
        _table("Solid", _solid_rows(report["solid"])),
        _table("Options", list(_option_rows(report["options"]))),
    ]


def _input_rows(facts: Report) -> Rows:
    low, high = facts["bounds"]
    dropped = [
        f"{count:,} {reason.replace('_', ' ')}"
        for reason, count in facts["dropped"].items()
        if count
    ]
    omitted = [f"{one['triangles']:,} of {one['name']}" for one in facts["omitted"]]
    return [
        ("triangles", f"{facts['triangles']:,}"),
        ("vertices", f"{facts['vertices']:,}"),
        ("lowest corner", ", ".join(map(length, low))),
        ("highest corner", ", ".join(map(length, high))),
        ("left out", ", ".join([*dropped, *omitted]) or "none"),
    ]


def _solid_rows(facts: Report) -> Rows:
    closed = [
        f"{item['by']} (added {length(item['volume'])} cubic units)" for item in facts["closed_by"]
    ]
    return [
        ("resolution", " x ".join(map(str, facts["resolution"])) + " voxels"),
        ("cell size", f"{length(facts['cell_size'])} units"),
        ("inside", percent(facts["inside_fraction"])),
        ("closed by", ", ".join(closed) or "nothing but its own surface"),
    ]


def _option_rows(options: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Those of a group each with the group's name before its own."""
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from ((f"{name}: {own}", text) for own, text in _option_rows(value))
        else:
            yield name, _plain(value)


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(_plain, value)) or "none"
    return "default" if value is None else str(value)


def _table(title: str, rows: Rows) -> str:
    cells = "".join(
        f"<tr><th scope=row>{escape(key.replace('_', ' '))}</th><td>{escape(value)}</td></tr>"
        for key, value in rows
    )
    return f'<div class="card"><table><caption>{escape(title)}</caption>{cells}</table></div>'
