"""The published schema of reports."""

from __future__ import annotations

import json
from pathlib import Path

from jsonschema import Draft202012Validator

SCHEMA = json.loads((Path(__file__).parents[1] / "docs" / "report.schema.json").read_text())


def check_report(report):
    """Raise for the first key that is not as the schema says."""
    Draft202012Validator(SCHEMA).validate(report)
