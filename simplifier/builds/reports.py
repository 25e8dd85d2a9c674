"""Findings as Markdown, for the summary page of a CI run or a comment on a change.

Findings as JUnit XML, which CI systems show test by test.

Findings as JSON, for programs.

Findings in a few words.
"""

from __future__ import annotations

import json
import posixpath
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from simplifier.builds.finding import Finding, State
from simplifier.version import VERSION
from simplifier.wording import overhang_words, percent

_MOST_ROWS = 500  # such pages take a megabyte


def markdown_report(name: str, findings: Sequence[Finding]) -> bytes:
    """A headline, and a row for each asset that is not as it was, those to blame first."""
    rows = [one for one in findings if one.faults or one.state is not State.CURRENT]
    rows.sort(key=lambda one: (not one.faults, one.asset))
    lines = [f"### {_plain(name)}: {headline(findings)}", ""]
    if rows:
        lines += [
            "| asset | | verdict | triangles | recall | precision | overhang | |",
            "|---|---|---|---:|---:|---:|---:|---|",
            *map(_markdown_row, rows[:_MOST_ROWS]),
        ]
    if len(rows) > _MOST_ROWS:
        lines += ["", f"and {len(rows) - _MOST_ROWS:,} more"]
    return ("\n".join(lines).rstrip() + "\n").encode()


def _markdown_row(finding: Finding) -> str:
    found = finding.figures
    mark = "❌" if finding.faults else "✅"
    figures = (
        [""] * 5
        if found is None
        else [
            found.verdict or "", f"{found.triangles:,}", percent(found.recall, 2),
            percent(found.precision, 2), overhang_words(found.overhang),
        ]
    )  # fmt: skip
    why = "; ".join(finding.faults) or finding.why
    return f"| {' | '.join([_plain(finding.asset), mark, *figures, _plain(why)])} |"


def _plain(text: str) -> str:
    """Text that Markdown takes as it stands, in one line."""
    line = " ".join(text.split())
    return "".join(f"\\{one}" if one in "\\`*_[]<>|#~" else one for one in line)


_UNFIT = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_report(name: str, findings: Sequence[Finding]) -> bytes:
    """A suite of that name with a case an asset; what it is to be blamed for is its failure."""
    failures = sum(1 for one in findings if one.faults)
    counts = {"tests": str(len(findings)), "failures": str(failures), "errors": "0"}
    seconds = f"{sum(one.seconds for one in findings):.3f}"
    suite = ET.Element("testsuite", {"name": _fit(name), **counts, "time": seconds})
    suite.extend(map(_case, findings))
    suites = ET.Element("testsuites", counts)
    suites.append(suite)
    ET.indent(suites)
    return bytes(ET.tostring(suites, encoding="utf-8", xml_declaration=True)) + b"\n"


def _case(finding: Finding) -> ET.Element:
    folder, file = posixpath.split(_fit(finding.asset))
    case = ET.Element(
        "testcase", {"classname": folder or ".", "name": file, "time": f"{finding.seconds:.3f}"}
    )
    if finding.faults:
        failure = ET.SubElement(case, "failure", {"message": _fit(finding.faults[0])})
        failure.text = _fit("\n".join(finding.faults))
    if finding.warnings:
        ET.SubElement(case, "system-err").text = _fit("\n".join(finding.warnings))
    return case


def _fit(text: str) -> str:
    """Without what XML cannot hold: file names hold nearly anything."""
    return _UNFIT.sub("\ufffd", text)


_SCHEMA_VERSION = 1


def json_report(name: str, findings: Sequence[Finding]) -> bytes:
    """``assets`` in the order of the findings; shares are fractions from 0 to 1."""
    content = {
        "schema_version": _SCHEMA_VERSION,
        "version": VERSION,
        "manifest": name,
        "good": not any(one.faults for one in findings),
        "assets": [_json_row(one) for one in findings],
    }
    return f"{json.dumps(content, indent=1, allow_nan=False)}\n".encode()


def _json_row(finding: Finding) -> dict[str, Any]:
    return {
        "asset": finding.asset,
        "state": finding.state,
        "why": finding.why,
        "faults": finding.faults,
        "warnings": finding.warnings,
        "seconds": round(finding.seconds, 3),
        "figures": None if finding.figures is None else asdict(finding.figures),
    }


def headline(findings: Sequence[Finding]) -> str:
    """How many assets, in which states, and how many fall short."""
    counts = Counter(one.state for one in findings)
    words = [f"{counts[state]:,} {state}" for state in State if counts[state]]
    short = sum(1 for one in findings if one.short)
    if short:
        words.append(f"{short:,} not good enough")
    what = "asset" if len(findings) == 1 else "assets"
    return f"{len(findings):,} {what}: {', '.join(words)}"
