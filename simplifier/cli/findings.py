"""How the commands that build many assets show what they found."""

from __future__ import annotations

from collections.abc import Sequence

from simplifier.builds.finding import AssetFigures, Finding, State
from simplifier.builds.reports import headline
from simplifier.cli.console import print_line, print_table, print_text
from simplifier.wording import overhang_words, percent


def print_findings(name: str, findings: Sequence[Finding]) -> None:
    """A table of what was made, what is to be blamed a line each, and a headline."""
    built = [one for one in findings if one.state is State.BUILT]
    if built:
        columns = (
            "asset", "verdict", "triangles", "recall", "precision", "overhang", "seconds", "why",
        )  # fmt: skip
        print_table(name, columns, [_row(one) for one in built])
    for one in findings:
        for warning in one.warnings:
            print_line(f"warning: {one.asset}: {warning}")
        for fault in one.faults:
            print_line(f"error: {one.asset}: {fault}")
    print_text(headline(findings))


def line_of(finding: Finding) -> str:
    """A finding as one line."""
    if finding.faults:
        return f"{finding.asset}: {'; '.join(finding.faults)}"
    found = finding.figures
    figures = "" if found is None else f": {figures_line(found)}"
    why = f" ({finding.why})" if finding.why else ""
    return f"{finding.asset}: {finding.state}{why}{figures}"


def figures_line(found: AssetFigures) -> str:
    """Figures of an occluder as they stand in a line."""
    words: list[str] = [found.verdict] if found.verdict else []
    words += [
        f"{found.triangles:,} triangles", f"recall {percent(found.recall, 2)}",
        f"precision {percent(found.precision, 2)}",
    ]  # fmt: skip
    words += [] if found.overhang is None else [f"overhang {overhang_words(found.overhang)}"]
    return ", ".join(words)


def _row(finding: Finding) -> tuple[str, ...]:
    found = finding.figures
    figures = ("",) * 5 if found is None else (
        found.verdict or "", f"{found.triangles:,}", percent(found.recall, 2),
        percent(found.precision, 2), overhang_words(found.overhang),
    )  # fmt: skip
    return (finding.asset, *figures, f"{finding.seconds:.1f}", finding.why)
