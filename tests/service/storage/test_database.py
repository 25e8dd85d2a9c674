"""Transactions, on either database."""

from __future__ import annotations

import ast

import pytest
from sqlalchemy import text

from service.access.key import Scope
from service.storage.database import Database
from service.storage.key_store import SqlKeyStore
from tests.acceptance.command import ROOT


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


def test_whatever_writes_is_done_again_where_the_database_undoes_it() -> None:
    """But what another method calls, whose transaction it is in."""
    missing = []
    for path in (ROOT / "service" / "storage").rglob("*store*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.FunctionDef):
                continue
            writes = any(
                isinstance(one, ast.Attribute) and one.attr in ("writing", "together")
                for one in ast.walk(node)
            )
            if writes and "retried" not in map(ast.unparse, node.decorator_list):
                missing.append(f"{path.name}: {node.name}")
    assert missing == []
