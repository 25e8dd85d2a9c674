"""How the service is, on the wire."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field


class Health(BaseModel):
    """The service answers."""

    status: Literal["ok"] = "ok"
    version: str = Field(description="Of the library.")


class Readiness(BaseModel):
    """The service can take jobs."""

    status: Literal["ready"] = "ready"
    checks: list[str] = Field(
        description="What was looked at.", examples=[["database", "disk", "engine"]]
    )
