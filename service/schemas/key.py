"""API keys and the journal on the wire."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from service.access.key import LONGEST_NAME, LONGEST_OVERLAP, ApiKey, Scope, key_name
from service.journal import Action, Entry
from service.schemas.job import Moment, moment, moment_or_none

Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME), AfterValidator(key_name)]


class KeyBody(BaseModel):
    """An API key, without its secret."""

    id: str
    name: str = Field(description="What it is for, for people.", examples=["build farm"])
    scope: Scope = Field(description="What it allows; each includes those before.")
    begins: str = Field(description="Its first characters.", examples=["occ_Ab3d"])
    created: datetime
    last_used: datetime | None = Field(description="To the minute.")
    expires: datetime | None = Field(description="When it ends by itself.")
    revoked: datetime | None = Field(
        description="When it was ended; ahead of now where another replaces it."
    )
    replaces: str | None = Field(description="Id of the key in whose place it was made.")
    curates: bool = Field(
        description="Whether it may set thresholds and remove assets without being an admin's, as "
        "keys of before may."
    )

    @classmethod
    def of(cls, key: ApiKey, **more: Any) -> Self:
        return cls(
            id=key.id,
            name=key.name,
            scope=key.scope,
            begins=key.hint,
            created=moment(key.created),
            last_used=moment_or_none(key.last_used),
            expires=moment_or_none(key.expires),
            revoked=moment_or_none(key.revoked),
            replaces=key.replaces,
            curates=key.curates,
            **more,
        )


class NewKeyBody(KeyBody):
    """A key that was just made, with its secret."""

    secret: str | None = Field(
        description="The key itself; it is shown this once, and null where the answer is replayed."
    )

    def to_keep(self) -> Self:
        """What may be kept of it: no secret is in the database."""
        return self.model_copy(update={"secret": None})


class KeyListBody(BaseModel):
    """All keys."""

    items: list[KeyBody]


class WantedKey(BaseModel):
    """A key to be made."""

    model_config = ConfigDict(extra="forbid")

    name: Name = Field(
        default_factory=str,
        description="What it is for, for people; left out, it has no name.",
        examples=["build farm"],
    )
    scope: Scope = Field(Scope.WRITE, description="What it is to allow.")
    expires: Moment | None = Field(None, description="When it ends by itself; null for never.")


class WantedRotation(BaseModel):
    """How a key is to be replaced."""

    model_config = ConfigDict(extra="forbid")

    overlap: float = Field(
        86_400.0, ge=0.0, le=LONGEST_OVERLAP, description="Seconds for which the old one goes on."
    )
    expires: Moment | None = Field(
        None, description="When the new one ends by itself; null for a life as long as the old's."
    )


class EntryBody(BaseModel):
    """A line of the journal."""

    at: datetime
    actor: str = Field(
        description="Id of the key of whoever did it, `command-line`, or `no-key` where none was "
        "needed."
    )
    address: str | None = Field(description="From which it came, if by HTTP.")
    action: str = Field(
        description=f"One of {', '.join(f'`{one}`' for one in Action)}, and whatever may be added."
    )
    subject: str = Field(description="Id of what it was done to.")
    details: dict[str, Any] = Field(description="What else there is to know.")

    @classmethod
    def of(cls, entry: Entry) -> Self:
        return cls(
            at=moment(entry.at),
            actor=entry.actor,
            address=entry.address,
            action=entry.action,
            subject=entry.subject,
            details=dict(entry.details),
        )


class EntryPageBody(BaseModel):
    """Entries of the journal, newest first."""

    items: list[EntryBody]
    next: str | None = Field(description="Where the next page is; null on the last.")
