"""Transactions, on either database."""

from __future__ import annotations

import pytest
from sqlalchemy import text

from service.access.key import Scope
from service.storage.database import Database
from service.storage.key_store import SqlKeyStore


def test_an_error_undoes_the_transaction(database: Database) -> None:
    keys = SqlKeyStore(database)
    keys.create("studio", "build farm", Scope.WRITE)

    def delete_half_way() -> None:
        with database.writing() as session:
            session.execute(text("DELETE FROM api_keys"))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        delete_half_way()
    assert len(keys.keys()) == 1
