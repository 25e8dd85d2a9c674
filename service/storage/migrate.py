"""Bringing a database to the schema of this version, by the scripts in ``migrations``."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection

from service.errors import SettingsError

_SCRIPTS = Path(__file__).with_name("migrations")


def migrate(connection: Connection) -> None:
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


def alembic_config(connection: Connection) -> Config:
    """For Alembic's commands on an open connection."""
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS).replace("%", "%%"))
    config.attributes["connection"] = connection
    return config
