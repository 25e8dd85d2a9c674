"""The commands on API keys.  They work on the data folder itself, also while a server runs on it.

What programs may want, the secret of a new key above all, is alone on standard output.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.access.key import LOCAL, ApiKey, Scope
from service.cli.command import run_command
from simplifier import OptionError
from simplifier.cli.plugin import Debug, print_line, print_text

if TYPE_CHECKING:
    from service.access.key import KeyStore
    from service.storage.data_folder import DataFolder

keys = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Make, list and revoke the API keys of a service, beside it or while it runs.",
)

Data = Annotated[
    Path | None,
    typer.Option(
        help="The service's folder.",
        show_default="OCCLUDER_DATA or occluder_data",
        metavar="FOLDER",
    ),
]
Tenant = Annotated[str, typer.Option(help="Whose: tenants do not see each other's jobs.")]

_TENANT = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", re.ASCII)
_LONGEST_NAME = 100


@keys.command()
def create(
    tenant: Tenant = LOCAL.tenant,
    name: Annotated[str, typer.Option(help="What it is for, for people.")] = "",
    scope: Annotated[
        Scope, typer.Option(help="read; write: jobs and assets too; admin: all.")
    ] = Scope.WRITE,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Make a key and print it, this once."""

    def run() -> None:
        _check_tenant(tenant)
        if len(name) > _LONGEST_NAME or not name.isprintable():
            raise OptionError(
                "a name has at most 100 characters, and none that cannot be printed",
                where="name",
                remedy="choose another one",
            )
        folder = _folder(data)
        folder.make()
        with _store(folder) as store:
            key, secret = store.create(tenant, name, scope)
        print_text(secret)
        print_line(f"key {key.id} of {tenant} may {scope}; it is shown only now, so keep it safe")

    run_command(run, debug=debug)


@keys.command("list")
def list_keys(
    tenant: Annotated[str | None, typer.Option(help="Only this one's.", show_default="all")] = None,
    data: Data = None,
    debug: Debug = False,
) -> None:
    """Print what keys there are, without their secrets."""

    def run() -> None:
        with _store(known_folder(data)) as store:
            found = store.keys(tenant)
        if not found:
            print_line("there are no keys; 'occluder keys create' makes one")
            return
        for line in table([{name: tell(key) for name, tell in _COLUMNS.items()} for key in found]):
            typer.echo(line)  # print_text would close up the columns; all that is here is printable

    run_command(run, debug=debug)


@keys.command()
def revoke(
    key: Annotated[str, typer.Argument(help="Its id, or its first characters as listed.")],
    data: Data = None,
    debug: Debug = False,
) -> None:
    """End a key: from the next second on nobody comes in by it."""

    def run() -> None:
        with _store(known_folder(data)) as store:
            ended = store.revoke(key)
        print_line(f"key {ended.id} of {ended.tenant} is revoked")

    run_command(run, debug=debug)


@keys.command()
def secret(tenant: Tenant = LOCAL.tenant, data: Data = None, debug: Debug = False) -> None:
    """Print what a tenant's webhooks are signed with, for their receivers."""

    def run() -> None:
        from service.storage.secret_ages import SqlSecretAges
        from service.webhooks.tenant_secrets import TenantSecrets

        folder = known_folder(data)
        with _store(folder) as store:
            known = {LOCAL.tenant, *store.tenants()}
        if tenant not in known:
            raise OptionError(
                f"no key is of {tenant!r}",
                where="tenant",
                remedy=f"choose one of {', '.join(sorted(known))}",
            )
        with closing(folder.open_database()) as database:
            generation = SqlSecretAges(database).age(tenant).generation
        print_text(TenantSecrets.open(folder.path).of(tenant, generation))

    run_command(run, debug=debug)


def _check_tenant(tenant: str) -> None:
    if not _TENANT.fullmatch(tenant):
        raise OptionError(
            f"{tenant!r} is no name of a tenant",
            where="tenant",
            remedy="give 1 to 64 letters, digits, dots, hyphens or underscores",
        )


def _folder(data: Path | None) -> DataFolder:
    # Here, not above: 'occluder --help' need not have a database installed.
    from service.settings import read_settings
    from service.storage.data_folder import DataFolder

    return DataFolder(read_settings({"data": data}).data)


def known_folder(data: Path | None) -> DataFolder:
    """The folder, if a key was made or a server has run in it: a slip must not make another."""
    folder = _folder(data)
    if not folder.database.exists():
        raise OptionError(
            f"'{folder.path}' is no folder of a service",
            where="data",
            remedy="name it by --data or OCCLUDER_DATA; 'occluder keys create' makes one",
        )
    return folder


@contextmanager
def _store(folder: DataFolder) -> Iterator[KeyStore]:
    from service.storage.key_store import SqlKeyStore

    database = folder.open_database()
    try:
        yield SqlKeyStore(database)
    finally:
        database.close()


_COLUMNS: dict[str, Callable[[ApiKey], str]] = {
    "id": lambda key: key.id,
    "begins": lambda key: key.hint,
    "tenant": lambda key: key.tenant,
    "scope": lambda key: key.scope,
    "created": lambda key: _day(key.created),
    "last used": lambda key: _day(key.last_used),
    "revoked": lambda key: _day(key.revoked),
    "name": lambda key: key.name,
}


def table(found: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """Lines in columns that align, the heads first; each row has the same names."""
    rows = [list(found[0]), *(list(one.values()) for one in found)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield "  ".join(cells).rstrip()


def _day(seconds: float | None) -> str:
    return "-" if seconds is None else f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M}"
