"""One server leads, and another when it is gone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from service.storage.leadership import Leadership
from service.storage.postgres import Place
from tests.postgres import PostgresServer
from tests.waiting import until


@pytest.fixture
def address(postgres: PostgresServer) -> Iterator[str]:
    address = postgres.empty_database()
    yield address
    postgres.drop(address)


def leaders(candidates: list[Leadership]) -> list[int]:
    return [number for number, one in enumerate(candidates) if one.held()]


def test_one_of_three_leads_and_another_when_it_ends(address: str) -> None:
    candidates = [Leadership(Place.of(address), 0.05) for _ in range(3)]
    with ExitStack() as running:
        blocks = [running.enter_context(ExitStack()) for _ in candidates]
        for block, candidate in zip(blocks, candidates, strict=True):
            block.enter_context(candidate.running())
        (first,) = until(lambda: leaders(candidates))
        blocks[first].close()
        assert not candidates[first].held()
        (second,) = until(lambda: leaders(candidates))
        assert second != first


def test_who_is_cut_off_leads_no_more(postgres: PostgresServer, address: str) -> None:
    candidate = Leadership(Place.of(address), 0.05)
    name = address.rpartition("/")[2]
    with candidate.running():
        until(candidate.held)
        postgres.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS false")
        postgres.execute(
            f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"
        )
        until(lambda: not candidate.held())
        postgres.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS true")
        until(candidate.held)


def test_a_leader_that_says_nothing_is_cut_off(
    postgres: PostgresServer, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one that is stopped: its connection stays open, and nothing comes."""
    monkeypatch.setattr("service.storage.leadership._SILENCE", "300ms")
    stopped, other = Leadership(Place.of(address), 60.0), Leadership(Place.of(address), 0.05)
    with stopped.running():
        until(stopped.held)
        with other.running():
            until(other.held)
