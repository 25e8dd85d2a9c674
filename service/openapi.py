"""Writes ``openapi.yaml``: ``python -m service.openapi``."""

from __future__ import annotations

from pathlib import Path

import yaml

from service.routes.api import make_api

FILE = Path(__file__).parent.parent / "openapi.yaml"


def document() -> str:
    """The API's description, as the file holds it."""
    text: str = yaml.safe_dump(make_api().openapi(), sort_keys=False, allow_unicode=True, width=100)
    return text


if __name__ == "__main__":
    FILE.write_text(document())
