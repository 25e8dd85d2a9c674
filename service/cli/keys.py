"""The commands on API keys.  They work on the database itself, also while servers run on it.

What programs may want, the secret of a new key above all, is alone on standard output.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.access.key import LOCAL, ApiKey, Scope, key_name
from service.cli.command import run_command
from service.cli.moments import moment_words, read_duration, read_moment
from service.cli.table import aligned
from service.journal import COMMAND_LINE, Action, Entry
from simplifier import OptionError
from simplifier.cli.plugin import Debug, print_line, print_text

if TYPE_CHECKING:
    from service.access.key import KeyStore
    from service.settings import Settings
    from service.storage.database import Database

keys = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Make, list, rotate and revoke the API keys of a service, beside it or while it runs.",
)

Data = Annotated[
    Path | None,
    typer.Option(
        help="The service's folder.",
        show_default="OCCLUDER_DATABASE_URL, OCCLUDER_DATA or occluder_data",
        metavar="FOLDER",
    ),
]
Tenant = Annotated[str, typer.Option(help="Whose: tenants do not see each other's jobs.")]
Key = Annotated[str, typer.Argument(help="Its id, or its first characters as listed.")]
Expires = Annotated[
    str | None,
    typer.Option(
        help="When it ends by itself: after a time, as 12h, 90d, 52w, or on a date, as 2027-01-31 "
        "(UTC).",
        show_default="never; for rotate, as long as the old one lived",
    ),
]

_TENANT = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", re.ASCII)


@keys.command()
def create(
    tenant: Tenant = LOCAL.tenant,
    name: Annotated[str, typer.Option(help="What it is for, for people.")] = "",
    scope: Annotated[
        Scope,
        typer.Option(help="read; write: jobs and assets too; admin: keys, thresholds, removal."),
    ] = Scope.WRITE,
    expires: Expires = None,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Make a key and print it, this once."""

    def run() -> None:
        _check_tenant(tenant)
        try:
            key_name(name)
        except ValueError as error:
            raise OptionError(str(error), where="name", remedy="choose another one") from None
        end = _end(expires)
        from service.storage.data_folder import DataFolder

        settings = settings_of(data)
        if settings.database_url is None:
            DataFolder(settings.data).make()
        with _opened(settings) as opened:
            key, secret = opened.keys.create(tenant, name, scope, expires=end)
        print_text(secret)
        until = "" if key.expires is None else f" until {moment_words(key.expires)}"
        print_line(
            f"key {key.id} of {tenant} may {scope}{until}; it is shown only now, so keep it safe"
        )

    run_command(run, debug=debug)


@keys.command("list")
def list_keys(
    tenant: Annotated[str | None, typer.Option(help="Only this one's.", show_default="all")] = None,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Print what keys there are, without their secrets."""

    def run() -> None:
        with open_known(data) as opened:
            found = opened.keys.keys(tenant)
        if not found:
            print_line("there are no keys; 'occluder keys create' makes one")
            return
        for line in _table(_COLUMNS, found):
            typer.echo(line)  # print_text would close up the columns; all that is here is printable

    run_command(run, debug=debug)


@keys.command()
def rotate(
    key: Key,
    overlap: Annotated[
        str, typer.Option(help="How long the old one goes on, as 30m, 24h, 7d; 0h for not at all.")
    ] = "24h",
    expires: Expires = None,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Print a new key in place of one, which goes on until the overlap ends.

    The new one may what the old one may, and lives as long.
    """

    def run() -> None:
        seconds, end = read_duration(overlap, "overlap"), _end(expires)
        with open_known(data) as opened:
            done = opened.keys.rotate(key, overlap=seconds, expires=end)
        old, new = done.old, done.new
        print_text(done.secret)
        print_line(
            f"key {new.id} of {new.tenant} replaces {old.id}, which ends"
            f" {moment_words(old.revoked)}; it is shown only now, so keep it safe"
        )

    run_command(run, debug=debug)


@keys.command()
def revoke(
    key: Key,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """End a key: from the next second on nobody comes in by it."""

    def run() -> None:
        with open_known(data) as opened:
            ended = opened.keys.revoke(key)
        print_line(f"key {ended.id} of {ended.tenant} is revoked")

    run_command(run, debug=debug)


@keys.command()
def journal(
    tenant: Annotated[str | None, typer.Option(help="Only this one's.", show_default="all")] = None,
    since: Annotated[
        str | None,
        typer.Option(help="A date, or how long back, as 12h, 7d, 4w.", show_default="all"),
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most lines.")] = 100,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Print who did what, the newest first: keys, sign-ins, thresholds, what was removed."""

    def run() -> None:
        from service.storage.journal_store import SqlJournal

        begin = None if since is None else read_moment(since, "since", time.time(), back=True)
        with open_known(data) as opened:
            found = SqlJournal(opened.database).entries(tenant, since=begin, limit=limit).entries
        if not found:
            print_line("the journal has no such entries")
            return
        for line in _table(_ENTRY, found):
            typer.echo(line)

    run_command(run, debug=debug)


@keys.command()
def secret(tenant: Tenant = LOCAL.tenant, data: Data = None, debug: Debug = False) -> None:
    """Print what a tenant's webhooks are signed with, for their receivers."""

    def run() -> None:
        from service.storage.journal_store import SqlJournal
        from service.storage.secret_ages import SqlSecretAges

        with open_known(data) as opened:
            check_known(tenant, opened.keys)
            journal = SqlJournal(opened.database)
            journal.note(tenant, COMMAND_LINE, Action.WEBHOOK_SECRET_SHOWN, tenant)
            generation = SqlSecretAges(opened.database).age(tenant).generation
            print_text(opened.webhook_secret(tenant, generation))

    run_command(run, debug=debug)


def _check_tenant(tenant: str) -> None:
    if not _TENANT.fullmatch(tenant):
        raise OptionError(
            f"{tenant!r} is no name of a tenant",
            where="tenant",
            remedy="give 1 to 64 letters, digits, dots, hyphens or underscores",
        )


def check_known(tenant: str, keys: KeyStore) -> None:
    """Raises :class:`~simplifier.OptionError` for a tenant that has no key."""
    known = {LOCAL.tenant, *keys.tenants()}
    if tenant not in known:
        raise OptionError(
            f"no key is of {tenant!r}",
            where="tenant",
            remedy=f"choose one of {', '.join(sorted(known))}",
        )


def settings_of(data: Path | None) -> Settings:
    """The settings, with a folder that was named by hand in place of all others.

    Raises :class:`~service.errors.SettingsError`.
    """
    # Here, not above: 'occluder keys --help' need not have a database installed.
    from service.settings import read_settings

    settings = read_settings({"data": data})
    # Who names a folder means that.
    return settings if data is None else settings.model_copy(update={"database_url": None})


@contextmanager
def open_known(data: Path | None) -> Iterator[Opened]:
    """The database of a service, if a key was made or a server has run there: a slip must not make
    another."""
    from service.storage.data_folder import DataFolder

    settings = settings_of(data)
    folder = DataFolder(settings.data)
    if settings.database_url is None and not folder.database.exists():
        raise OptionError(
            f"'{folder.path}' is not a folder of a service",
            where="data",
            remedy="name it by --data or OCCLUDER_DATA; 'occluder keys create' makes one",
        )
    with _opened(settings) as opened:
        yield opened


@contextmanager
def _opened(settings: Settings) -> Iterator[Opened]:
    from service.storage.opening import open_database

    with closing(open_database(settings)) as database:
        yield Opened(settings, database)


@dataclass(frozen=True)
class Opened:
    """A database, and the settings by which it was found."""

    settings: Settings
    database: Database

    @property
    def keys(self) -> KeyStore:
        from service.storage.key_store import SqlKeyStore

        return SqlKeyStore(self.database)

    def webhook_secret(self, tenant: str, generation: int) -> str:
        """What a tenant's webhooks are signed with after so many rotations."""
        from service.webhooks.tenant_secrets import TenantSecrets

        return TenantSecrets.named_by(self.settings).of(tenant, generation)


def _end(expires: str | None) -> float | None:
    return None if expires is None else read_moment(expires, "expires", time.time())


def _table(columns: Mapping[str, Callable[[Any], str]], rows: Iterable[object]) -> Iterator[str]:
    """Lines in columns that align, the heads first."""
    return aligned([list(columns), *([tell(row) for tell in columns.values()] for row in rows)])


def _rights(key: ApiKey) -> str:
    """``write*`` may what a key to write could before rights to remove were asked for."""
    return f"{key.scope}{'*' if key.curates else ''}"


_COLUMNS: dict[str, Callable[[ApiKey], str]] = {
    "id": lambda key: key.id,
    "begins": lambda key: key.hint,
    "tenant": lambda key: key.tenant,
    "scope": _rights,
    "created": lambda key: moment_words(key.created),
    "last used": lambda key: moment_words(key.last_used),
    "expires": lambda key: moment_words(key.expires),
    "revoked": lambda key: moment_words(key.revoked),
    "name": lambda key: key.name,
}

_ENTRY: dict[str, Callable[[Entry], str]] = {
    "when": lambda entry: moment_words(entry.at),
    "tenant": lambda entry: entry.tenant,
    "who": lambda entry: entry.actor,
    "from": lambda entry: entry.address or "-",
    "what": lambda entry: entry.action,
    "of": lambda entry: entry.subject,
    "more": lambda entry: json.dumps(entry.details) if entry.details else "",
}
