"""Findings as Markdown, for the summary page of a CI run or a comment on a change."""

from __future__ import annotations

from collections.abc import Sequence

from simplifier.builds.finding import Finding, State
from simplifier.builds.words import headline
from simplifier.wording import percent

_MOST_ROWS = 500  # such pages take a megabyte


def markdown_report(name: str, findings: Sequence[Finding]) -> bytes:
    """A headline, and a row for each asset that is not as it was, those to blame first."""
    rows = [one for one in findings if one.faults or one.state is not State.CURRENT]
    rows.sort(key=lambda one: (not one.faults, one.asset))
    lines = [f"### {_plain(name)}: {headline(findings)}", ""]
    if rows:
        lines += [
            "| asset | | triangles | recall | precision | |",
            "|---|---|---:|---:|---:|---|",
            *map(_row, rows[:_MOST_ROWS]),
        ]
    if len(rows) > _MOST_ROWS:
        lines += ["", f"and {len(rows) - _MOST_ROWS:,} more"]
    return ("\n".join(lines).rstrip() + "\n").encode()


def _row(finding: Finding) -> str:
    found = finding.figures
    mark = "❌" if finding.faults else "✅"
    figures = (
        ["", "", ""]
        if found is None
        else [f"{found.triangles:,}", percent(found.recall, 2), percent(found.precision, 2)]
    )
    why = "; ".join(finding.faults) or finding.why
    return f"| {' | '.join([_plain(finding.asset), mark, *figures, _plain(why)])} |"


def _plain(text: str) -> str:
    """Text that Markdown takes as it stands, in one line."""
    line = " ".join(text.split())
    return "".join(f"\\{one}" if one in "\\`*_[]<>|#~" else one for one in line)
