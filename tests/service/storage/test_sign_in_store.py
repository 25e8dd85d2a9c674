"""Unknown keys count at all servers together, as they do in one process."""

from __future__ import annotations

from contextlib import closing

from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import text

from service.access.attempts import LIMIT, FailedAttempts
from service.storage.postgres import PostgresDatabase
from service.storage.sign_in_store import SqlFailedAttempts
from tests.service.storage.fresh import ReusedPostgres


class Clocked:
    """A database whose clock is set by hand."""

    def __init__(self, database: PostgresDatabase) -> None:
        self._database = database
        self.now = 1000.0

    def __getattr__(self, name: str) -> object:
        return getattr(self._database, name)

    def clock(self) -> float:
        return self.now


ACTS = st.lists(
    st.one_of(
        st.tuples(
            st.sampled_from(["1.2.3.4", "::1", "2001:db8::1"]), st.sampled_from(["", "occ_a"])
        ),
        st.floats(0.0, 90.0),
        st.integers(1, 30),
    ),
    max_size=25,
)


def test_two_servers_count_as_one_process_does(postgres_database: PostgresDatabase) -> None:
    database = postgres_database

    @settings(max_examples=12)
    @given(ACTS)
    def follow(acts: list[object]) -> None:
        clocked = Clocked(database)
        with database.writing() as session:
            session.execute(text("DELETE FROM failed_sign_ins"))
        here, there = SqlFailedAttempts(clocked), SqlFailedAttempts(clocked)  # type: ignore[arg-type]
        plain = FailedAttempts(lambda: clocked.now)
        last = ("1.2.3.4", "")
        for number, act in enumerate(acts):
            store = here if number % 2 else there
            match act:
                case (str(), str()):
                    last = act  # type: ignore[assignment]
                    store.count(*last)
                    plain.count(*last)
                case float():
                    clocked.now += act
                case int():
                    for _ in range(act):
                        store.count(*last)
                        plain.count(*last)
            waits = here.seconds_to_wait(*last), there.seconds_to_wait(*last)
            expected = plain.seconds_to_wait(*last)
            # Twice what is left of seconds may round to either side.
            assert all(abs(wait - expected) <= 1 for wait in waits)
            assert all((wait == 0) == (expected == 0) or expected == 1 for wait in waits)

    follow()


def test_too_many_at_one_server_wait_at_another(
    postgres_database: PostgresDatabase, reused_postgres: ReusedPostgres
) -> None:
    with closing(PostgresDatabase.open(reused_postgres.address)) as other:
        for _ in range(LIMIT + 5):
            SqlFailedAttempts(postgres_database).count("1.2.3.4")
        assert SqlFailedAttempts(other).seconds_to_wait("1.2.3.4") > 0
        assert SqlFailedAttempts(other).seconds_to_wait("1.2.3.5") == 0
