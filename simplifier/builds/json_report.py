"""Findings as JSON, for programs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from simplifier.builds.finding import Finding
from simplifier.version import VERSION

_SCHEMA_VERSION = 1


def json_report(name: str, findings: Sequence[Finding]) -> bytes:
    """``assets`` in the order of the findings; shares are fractions from 0 to 1."""
    content = {
        "schema_version": _SCHEMA_VERSION,
        "version": VERSION,
        "manifest": name,
        "good": not any(one.faults for one in findings),
        "assets": [_row(one) for one in findings],
    }
    return f"{json.dumps(content, indent=1, allow_nan=False)}\n".encode()


def _row(finding: Finding) -> dict[str, Any]:
    return {
        "asset": finding.asset,
        "state": finding.state,
        "why": finding.why,
        "faults": finding.faults,
        "warnings": finding.warnings,
        "seconds": round(finding.seconds, 3),
        "figures": None if finding.figures is None else asdict(finding.figures),
    }
