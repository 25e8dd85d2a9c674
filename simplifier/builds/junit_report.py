"""Findings as JUnit XML, which CI systems show test by test."""

from __future__ import annotations

import posixpath
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from simplifier.builds.finding import Finding

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
