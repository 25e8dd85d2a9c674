"""Which tables the database has, and which release may use them.

The numbers of the migrations are those of the schema.  A database that several servers share is
brought to a new schema by ``occluder migrate``, while servers of the release before still run: so
each schema says from which number on a release may run on it, and each migration must leave what
the release before needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, inspect, text

from service.errors import SettingsError
from simplifier import __version__

RUNS_FROM = "0012"
"""The oldest schema whose release runs on the present one: raise it when a migration takes away
what that release needs."""

_SCRIPTS = Path(__file__).with_name("migrations")


@dataclass(frozen=True)
class Deployed:
    """What a database says of itself.

    ``schema``     its number; None where there are no tables.
    ``runs_from``  the schema of the oldest release that may use it.
    ``release``    that migrated it last: its servers take work.
    """

    schema: str | None
    runs_from: str = ""
    release: str = ""


def migrate(connection: Connection, release: str = __version__) -> None:
    """Within the connection's transaction: all of it, or nothing.

    Raises :class:`~service.errors.SettingsError` when a newer version has been here.
    """
    try:
        command.upgrade(alembic_config(connection), "head")
    except CommandError as error:
        raise SettingsError(
            f"the database is not of this version ({error}); "
            "start the version that it was last used with, or a newer one"
        ) from error
    connection.execute(
        text(
            "INSERT INTO deployment (number, release, runs_from) VALUES (1, :release, :oldest)"
            " ON CONFLICT (number) DO UPDATE SET release = :release, runs_from = :oldest"
        ),
        {"release": release, "oldest": RUNS_FROM},
    )


def deployed(connection: Connection) -> Deployed:
    """What the database says of itself."""
    if not inspect(connection).has_table("alembic_version"):
        return Deployed(None)
    schema = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    if schema is None or not inspect(connection).has_table("deployment"):
        return Deployed(schema)
    told = connection.execute(text("SELECT runs_from, release FROM deployment")).one()
    return Deployed(schema, told.runs_from, told.release)


def check_schema(found: Deployed, release: str = __version__) -> None:
    """Raises :class:`~service.errors.SettingsError` where this release cannot use the tables."""
    mine = newest_schema()
    if found.schema is None:
        raise SettingsError("the database has no tables yet; run 'occluder migrate' once")
    if found.schema < mine:
        raise SettingsError(
            f"the database has schema {found.schema}, and release {release} needs {mine}; "
            "run 'occluder migrate' of this release"
        )
    if found.schema > mine and found.runs_from > mine:
        raise SettingsError(
            f"the database has schema {found.schema} of release {found.release}, on which release "
            f"{release} cannot run; install {found.release}"
        )


def newest_schema() -> str:
    """The number of this release's schema."""
    config = Config()
    config.set_main_option("script_location", _location())
    head = ScriptDirectory.from_config(config).get_current_head()
    assert head is not None  # there are scripts
    return head


def alembic_config(connection: Connection) -> Config:
    """The configuration of Alembic's commands on an open connection."""
    config = Config()
    config.set_main_option("script_location", _location())
    config.attributes["connection"] = connection
    return config


def _location() -> str:
    return str(_SCRIPTS).replace("%", "%%")
