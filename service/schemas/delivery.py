"""Webhooks on the wire, with what came of each try."""

from __future__ import annotations

from datetime import datetime
from typing import Self

from pydantic import BaseModel, Field

from service.jobs.deliveries import DeliveryAttempt, DeliveryRecord, DeliveryState
from service.schemas.job import moment, origin


class DeliveryAttemptBody(BaseModel):
    """What came of one try."""

    at: datetime = Field(description="When it began.")
    milliseconds: float = Field(ge=0, description="Time until the answer, or until it was left.")
    status: int | None = Field(description="That the receiver answered with; null without one.")
    reason: str | None = Field(
        description="Why it does not count as heard; null where it does.",
        examples=["the receiver answered 500"],
    )
    excerpt: str | None = Field(
        description="The beginning of the answer, where that is text from a public address, "
        "without addresses of private networks; for keys that may write."
    )

    @classmethod
    def of(cls, attempt: DeliveryAttempt, *, whole: bool) -> Self:
        return cls(
            at=moment(attempt.at),
            milliseconds=attempt.milliseconds,
            status=attempt.status,
            reason=attempt.reason or None,
            excerpt=attempt.excerpt if whole else None,
        )


class DeliveryBody(BaseModel):
    """A webhook: whom it goes to, and what has come of it."""

    id: str = Field(
        description="The event's: `Occluder-Delivery` and `id` of the body, the same at every try."
    )
    job: str = Field(description="Where the job is that has ended.", examples=["/v1/jobs/j_7Qk2"])
    state: DeliveryState
    url: str = Field(
        description="The receiver; keys that only read see no more than the host.",
        examples=["https://ci.example.org/hooks/7f3a"],
    )
    created: datetime = Field(description="When the job ended.")
    due: datetime | None = Field(description="When it is tried next, while it waits.")
    redelivered: int = Field(ge=0, description="How often it was asked for by hand.")
    attempts: list[DeliveryAttemptBody] = Field(description="The last hundred, oldest first.")
    redeliver: str = Field(
        description="Where a POST sends it again.",
        examples=["/v1/deliveries/3f0c/redeliver"],
    )

    @classmethod
    def of(cls, record: DeliveryRecord, *, whole: bool) -> Self:
        """``whole``  whether the receiver's path and its answers are told."""
        one = record.delivery
        return cls(
            id=one.id,
            job=f"/v1/jobs/{one.job_id}",
            state=record.state,
            url=one.url if whole else origin(one.url),
            created=moment(record.created),
            due=moment(one.due) if record.state is DeliveryState.WAITING else None,
            redelivered=one.redelivered,
            attempts=[DeliveryAttemptBody.of(each, whole=whole) for each in record.attempts],
            redeliver=f"/v1/deliveries/{one.id}/redeliver",
        )


class DeliveryPageBody(BaseModel):
    """Webhooks, newest first."""

    items: list[DeliveryBody]
    next: str | None = Field(description="Where the next page is; null on the last.")
