"""Refusals as RFC 9457 has them."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.errors import ServiceError

MEDIA_TYPE = "application/problem+json"


class FieldProblem(BaseModel):
    """What is wrong with one field of a request."""

    field: str = Field(description="Its name.", examples=["budget"])
    detail: str = Field(description="The fault.", examples=["0 is out of range"])
    remedy: str = Field(description="What to do.", examples=["choose 1 to 100,000"])


class Problem(BaseModel):
    """Why a request was refused, and what to do."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(
        description="`/problems/` and a word that stays the same; the page there says more.",
        examples=["/problems/invalid-options"],
    )
    title: str = Field(description="The kind of problem, in words.")
    status: int = Field(description="The HTTP status.", examples=[422])
    detail: str = Field(description="What is wrong here, and where.")
    remedy: str = Field(description="What to do about it; may be empty.")
    instance: str = Field(description="The path that was asked for.")
    errors: list[FieldProblem] | None = Field(
        None, description="Each field that is wrong, where fields are."
    )


def problem_of(error: ServiceError, instance: str) -> dict[str, Any]:
    """The members of the answer; those that an error has beside the standard ones among them."""
    return {
        "type": f"/problems/{error.slug}",
        "title": error.title,
        "status": error.status,
        "detail": error.detail,
        "remedy": error.remedy,
        "instance": instance,
        **error.extra,
    }
