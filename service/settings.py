"""What the service is told by its surroundings: ``OCCLUDER_*`` and the command line.

``python -m service.settings`` prints the settings as a table of Markdown, for the docs.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from enum import StrEnum
from ipaddress import IPv4Network, IPv6Network, ip_address, ip_network
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, SecretStr, ValidationError, field_validator
from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict
from pydantic_settings import SettingsError as SourceError

from service.errors import SettingsError
from service.keep import Keep
from service.logs import LogForm

_MIB = 1 << 20


class EngineChoice(StrEnum):
    """What does the jobs that wait."""

    LOCAL = "local"
    """Worker processes of this server."""
    NONE = "none"
    """Others that share the database: ``occluder work``, or other servers."""
    RAY = "ray"
    """The nodes of a Ray cluster, to which ``occluder dispatch`` offers them."""


_PREFIX = "OCCLUDER_"
_OTHERS = {"OCCLUDER_KEY", "OCCLUDER_SERVER", "OCCLUDER_THREADS"}
"""Variables of that prefix that commands and the library read."""
_BUCKET = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,61}[a-z0-9](/[\w!.*'()-]+)*/?")
_UNITS = (("GiB", 1 << 30), ("MiB", 1 << 20))


def processors() -> int:
    """That this process may use."""
    # Not above: nothing that a server imports needs the library.
    from simplifier.control_groups import allowed_processors

    return allowed_processors()


def _network(told: object) -> object:
    """Of text, by itself: pydantic would complain of it once for each kind of network."""
    return ip_network(told) if isinstance(told, str) else told


class Settings(BaseSettings):
    """One attribute a setting: ``OCCLUDER_`` and its name in capitals.

    ``docs/service.md`` lists them from the descriptions here.
    """

    model_config = SettingsConfigDict(env_prefix="OCCLUDER_", frozen=True, extra="forbid")

    data: Path = Field(
        Path("occluder_data"), description="Folder of the database, the blobs and work under way."
    )
    database_url: SecretStr | None = Field(
        None,
        description="PostgreSQL database that several servers share, as "
        "postgresql://USER:PASSWORD@HOST:PORT/NAME; unset: a file in OCCLUDER_DATA.",
    )
    secret_file: Path | None = Field(
        None,
        description="File of the 32 secret bytes that sign webhooks and sessions, the same for all "
        "servers that share a database; unset: a file in OCCLUDER_DATA.",
    )
    blobs: str = Field(
        "",
        description="Where uploads and results are stored: s3://BUCKET/PREFIX, for several hosts, "
        "or, if empty, the folder of the data.",
    )
    blob_cache: int = Field(
        8192 * _MIB,
        ge=0,
        description="Bytes of the disk that copies of inputs may take, where OCCLUDER_BLOBS is a "
        "bucket.",
    )
    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    public_url: str = Field(
        "", description="How others reach the service, for links in webhooks; empty: by the host."
    )

    dashboard: bool = Field(True, description="Whether to show the pages for people, beside /v1.")

    log: LogForm = Field(
        LogForm.TEXT,
        description="How the log is written: text, a line for people; json, an object a line.",
    )

    require_keys: bool | None = Field(
        None, description="Whether an API key is needed; unset: as soon as one beyond loopback is."
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        (),
        description="Names that requests may come to, beside the address listened on: with commas "
        "between; *.example.org stands for all below it, * for any.",
    )
    trusted_proxies: Annotated[
        tuple[Annotated[IPv4Network | IPv6Network, BeforeValidator(_network)], ...], NoDecode
    ] = Field(
        (),
        description="Addresses and networks of the proxies in front, with commas between; the "
        "address that they tell by X-Forwarded-For or Forwarded is taken for the client's.",
    )

    engine: EngineChoice = Field(
        EngineChoice.LOCAL,
        description="What does the jobs: local, worker processes of this server; none, others that "
        "share the database; ray, the nodes to which 'occluder dispatch' offers them.",
    )
    workers: int = Field(
        default_factory=processors, ge=1, le=256, description="Jobs done at the same time."
    )
    attempts: int = Field(
        3, ge=1, le=20, description="How often a job whose process dies is tried."
    )
    job_seconds: float = Field(
        1800.0, gt=0.0, description="Time that a job may take, seconds; then it fails."
    )
    read_seconds: float = Field(
        300.0, gt=0.0, description="Time that reading the files of a job may take, seconds; then "
        "it fails."
    )  # fmt: skip
    job_memory: int = Field(
        4096 * _MIB,
        ge=256 * _MIB,
        description="Memory that a job may use, bytes; one that would "
        "need more fails before it begins.",
    )
    jobs_per_process: int = Field(
        500, ge=1, description="Jobs after which a warm process is replaced by a fresh one."
    )
    draw_at_once: bool = Field(
        False,
        description="Whether the pages and pictures of reports are drawn with each job; else when "
        "somebody first asks for them.",
    )
    keep: Keep = Field(
        Keep.ALL,
        description="Files of an occluder's result that are stored as its job ends, where the job "
        "does not say: all, or lean, the occluder and its report; others are then made when "
        "somebody first asks for them, and no pages are drawn with the job.",
    )
    lease_seconds: float = Field(
        30.0, ge=1.0, description="Time after which a silent server's jobs are taken over, seconds."
    )
    queue_limit: int = Field(
        1000, ge=1, description="Jobs that may wait; further ones are answered 429."
    )
    tenant_waiting: int | None = Field(
        None,
        ge=1,
        description="Jobs of one tenant that may wait; unset: half of OCCLUDER_QUEUE_LIMIT where "
        "another tenant has a key, else all of it.",
    )
    tenant_running: int | None = Field(
        None,
        ge=1,
        description="Jobs of one tenant done at the same time; unset: where another tenant has a "
        "key and there are several workers, one fewer than these.",
    )

    max_upload: int = Field(2048 * _MIB, ge=1, description="Largest upload, bytes.")
    max_unpacked: int = Field(
        8192 * _MIB, ge=1, description="Bytes that the zip of a scene may hold, unpacked."
    )
    upload_idle_seconds: float = Field(
        30.0, gt=0.0, description="Silence after which an upload is given up, seconds."
    )
    min_upload_rate: int = Field(
        1024, ge=0, description="Bytes a second that an upload must keep up on average, after a "
        "minute; 0 for any."
    )  # fmt: skip
    download_idle_seconds: float = Field(
        30.0, gt=0.0, description="Time for which a client may take nothing of an answer, seconds; "
        "then the connection is ended."
    )  # fmt: skip
    min_free: int = Field(
        256 * _MIB, ge=0, description="Bytes of the disk that are left free; then 507 is answered."
    )
    max_wait: float = Field(
        60.0, ge=0.0, description="Longest that 'Prefer: wait' makes an answer wait, seconds."
    )

    keep_days: float = Field(
        90.0, ge=0.0, description="Days that ended jobs are kept, 0 for ever; the latest run of an "
        "asset always stays."
    )  # fmt: skip
    journal_days: float = Field(
        365.0, ge=0.0, description="Days that the journal of who did what is kept, 0 for ever."
    )
    clean_seconds: float = Field(
        3600.0, gt=0.0, description="Time between two rounds of removing what is old, seconds."
    )

    scrub_days: float = Field(
        30.0, ge=0.0, description="Days within which all stored files are read anew and checked, 0 "
        "for never."
    )  # fmt: skip
    scrub_rate: int = Field(
        16 * _MIB, ge=1024, description="Bytes a second that are read for that at most."
    )

    metrics_assets: int = Field(
        1000, ge=0, description="Assets that have series of their own in /metrics, by name."
    )

    webhook_private: bool = Field(
        False, description="Whether webhooks may go to private and loopback addresses."
    )
    webhook_attempts: int = Field(8, ge=1, le=50, description="How often a webhook is tried.")
    webhook_seconds: float = Field(
        10.0, gt=0.0, description="Time that the receiver of a webhook has, seconds."
    )

    @field_validator("allowed_hosts", "trusted_proxies", mode="before")
    @classmethod
    def _by_commas(cls, listed: object) -> object:
        if not isinstance(listed, str):
            return listed
        return tuple(one.strip() for one in listed.split(",") if one.strip())

    @field_validator("blobs")
    @classmethod
    def _bucket(cls, url: str) -> str:
        if url and not _BUCKET.fullmatch(url):
            raise ValueError("must be s3://BUCKET/PREFIX")
        return url.rstrip("/")

    @field_validator("public_url")
    @classmethod
    def _http(cls, url: str) -> str:
        if url and not url.startswith(("http://", "https://")):
            raise ValueError("must begin with http:// or https://")
        return url.rstrip("/")

    @property
    def on_loopback(self) -> bool:
        """Whether only this machine can reach the service."""
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def keys_needed(self) -> bool:
        """Whether a request needs an API key."""
        return not self.on_loopback if self.require_keys is None else self.require_keys


def read_settings(chosen: Mapping[str, Any]) -> Settings:
    """``chosen`` on the command line goes before the environment; None leaves it to that.

    Raises :class:`~service.errors.SettingsError`, whose message has a line a setting.
    """
    try:
        return Settings(**{name: value for name, value in chosen.items() if value is not None})
    except ValidationError as error:
        raise SettingsError("\n".join(_fault_lines(error))) from None
    except SourceError as error:
        raise SettingsError(f"{error}; see docs/service.md") from None


def unknown_settings() -> Iterator[str]:
    """A line for each variable that is no setting but nearly one: a slip of the keyboard."""
    names = [_variable(name) for name in Settings.model_fields]
    for variable in sorted(os.environ):
        if variable.startswith(_PREFIX) and variable not in (*names, *_OTHERS):
            for meant in get_close_matches(variable, names, n=1, cutoff=0.85):
                yield f"{variable} is no setting and does nothing; did you mean {meant}?"


def _fault_lines(error: ValidationError) -> Iterator[str]:
    for fault in error.errors(include_url=False):
        name = str(fault["loc"][0]) if fault["loc"] else ""
        about = Settings.model_fields[name].description or ""
        message = fault["msg"].removeprefix("Value error, ")
        yield (
            f"{_variable(name)} cannot be {fault['input']!r}: "
            f"{message[:1].lower()}{message[1:]}; it is: {about.rstrip('.')}"
        )


def _variable(name: str) -> str:
    return f"{_PREFIX}{name.upper()}"


def settings_table() -> str:
    """A row a setting, in the order of :class:`~service.settings.Settings`."""
    return "\n".join(["| setting | default | meaning |", "|---|---|---|", *_table_rows()])


def _table_rows() -> Iterator[str]:
    for name, field in Settings.model_fields.items():
        meaning = (field.description or "").replace("|", "\\|")
        yield f"| `OCCLUDER_{name.upper()}` | {_default(field)} | {meaning} |"


def _default(field: FieldInfo) -> str:
    if field.default_factory is not None:
        return "one a processor"  # what depends on the machine
    return _table_cell(field.default)


def _table_cell(value: Any) -> str:
    if value is None or value in ("", ()):
        return "unset"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, int):
        for unit, size in _UNITS:
            if value >= size and value % size == 0:
                return f"`{value}` ({value // size} {unit})"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


if __name__ == "__main__":
    print(settings_table())
