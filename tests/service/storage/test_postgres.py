"""PostgreSQL: shared by several, refused where it will not do, and gone for a while."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import psycopg
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import Connection, create_engine, inspect, select, text

from service.access.key import Scope
from service.errors import NotReadyError, SettingsError, TenantQueueFullError
from service.jobs.job import Claim, JobState, Priority
from service.jobs.turns import Shares
from service.storage import postgres as module
from service.storage.database import Topic
from service.storage.job_store import SqlJobStore
from service.storage.key_store import SqlKeyStore
from service.storage.postgres import (
    Listener,
    Place,
    PostgresDatabase,
    migrate_server,
)
from service.storage.schema import newest_schema
from service.storage.tables import AssetRow, Base, JobRow
from tests.postgres import PostgresServer, free_port
from tests.service.storage.fresh import ReusedPostgres, share_statements
from tests.service.storage.samples import DIED, results, submission, summary
from tests.waiting import until

SERVERS = 8


@pytest.fixture
def address(reused_postgres: ReusedPostgres) -> str:
    """Of a database with tables."""
    reused_postgres.empty()
    return reused_postgres.address


@pytest.fixture
def own_address(postgres: PostgresServer) -> Iterator[str]:
    """Of one that nobody else has."""
    address = postgres.database()
    yield address
    postgres.drop(address)


@contextmanager
def servers(address: str, count: int = SERVERS) -> Iterator[list[PostgresDatabase]]:
    """Each stands for a process: nothing that one has in memory is known to the others."""
    with ExitStack() as opened:
        databases = [
            opened.enter_context(closing(PostgresDatabase.open(address))) for _ in range(count)
        ]
        for database in databases:
            share_statements(database)
        yield databases


@pytest.mark.parametrize("jobs", [40, pytest.param(120, marks=pytest.mark.slow)])
def test_eight_servers_claim_each_job_once(address: str, jobs: int) -> None:
    with servers(address) as databases:
        stores = [SqlJobStore(database) for database in databases]
        for number in range(jobs):
            asked = submission(str(number), tenant=f"tenant {number % 3}")
            stores[number % SERVERS].submit(asked, 1000)

        def claim_all(store: SqlJobStore) -> list[Claim]:
            claims: list[Claim] = []
            while claim := store.claim(f"server {id(store)}", 30.0):
                claims.append(claim)
                assert store.succeed(claim, results(claim.job.id), summary())
            return claims

        with ThreadPoolExecutor(SERVERS) as pool:
            claims = [one for found in pool.map(claim_all, stores) for one in found]
        assert Counter(one.job.attempt for one in claims) == {1: jobs}
        assert len({one.job.id for one in claims}) == jobs
        assert stores[0].counts()[JobState.SUCCEEDED] == jobs
        check_lines(databases[0])


def check_lines(database: PostgresDatabase) -> None:
    """The counts of the lines are those of the jobs."""
    counted = (
        "SELECT tenant, count(*) FILTER (WHERE state = 'queued'),"
        " count(*) FILTER (WHERE state = 'running') FROM jobs GROUP BY tenant ORDER BY tenant"
    )
    with database.reading() as session:
        kept = session.execute(text("SELECT tenant, waiting, running FROM lines ORDER BY tenant"))
        assert kept.all() == session.execute(text(counted)).all()


def test_a_tenant_runs_no_more_than_it_may_on_all_servers_together(address: str) -> None:
    with servers(address) as databases:
        stores = [SqlJobStore(one, shares=Shares(SERVERS, running=3)) for one in databases]
        for number in range(20):
            stores[0].submit(submission(str(number)), 100)
        with ThreadPoolExecutor(SERVERS) as pool:
            claims = list(pool.map(lambda store: store.claim("one", 30.0), stores))
        assert len([one for one in claims if one]) == 3
        check_lines(databases[0])


def test_no_more_of_a_tenant_wait_than_may(address: str) -> None:
    with servers(address) as databases:
        SqlKeyStore(databases[0]).create("rival", "farm", Scope.WRITE)
        stores = [SqlJobStore(database) for database in databases]

        def submit(number: int) -> bool:
            try:
                stores[number % SERVERS].submit(submission(str(number)), 20)
            except TenantQueueFullError:
                return False
            return True

        with ThreadPoolExecutor(SERVERS) as pool:
            assert sum(pool.map(submit, range(64))) == 10


def test_two_who_name_an_asset_at_once_make_but_one(address: str) -> None:
    with servers(address) as databases:
        at_once = threading.Barrier(SERVERS)

        def submit(database: PostgresDatabase) -> str | None:
            at_once.wait(10.0)
            store = SqlJobStore(database)
            return store.submit(submission(str(id(store)), asset="castle"), 100)[0].asset_id

        with ThreadPoolExecutor(SERVERS) as pool:
            assert len(set(pool.map(submit, databases))) == 1
        with databases[0].reading() as session:
            assert session.scalars(select(AssetRow.name)).all() == ["castle"]


def test_an_asset_that_is_removed_while_a_job_of_it_comes_is_made_anew(address: str) -> None:
    from service.jobs.asset import Thresholds
    from service.storage.asset_store import SqlAssetStore

    with servers(address, 2) as (one, two):
        assets, jobs = SqlAssetStore(one), SqlJobStore(two)
        for _ in range(10):
            castle, _ = assets.put("studio", "castle", Thresholds())
            with ThreadPoolExecutor(2) as pool:
                removal = pool.submit(assets.remove, "studio", castle.id)
                job, _ = pool.submit(jobs.submit, submission(asset="castle"), 100).result()
            if removal.exception() is None:
                assert assets.asset("studio", str(job.asset_id)).name == "castle"
            jobs.cancel(None, job.id)


def test_transactions_that_block_each_other_are_done_again(address: str) -> None:
    with servers(address, 2) as (one, two):
        SqlJobStore(one).submit(submission("a"), 10)
        SqlJobStore(one).submit(submission("b"), 10)
        met, done = threading.Barrier(2, timeout=10.0), threading.Event()
        tries = Counter[str]()

        def lock(database: PostgresDatabase, first: int, second: int) -> None:
            name = f"{first} {second}"
            tries[name] += 1
            if tries[name] > 1:
                assert done.wait(
                    10.0
                )  # or it may lock its row before the other, and they meet again
            with database.writing() as session:
                session.execute(text(f"UPDATE jobs SET beat = beat + 1 WHERE number = {first}"))
                if tries[name] == 1:
                    met.wait()
                session.execute(text(f"UPDATE jobs SET beat = beat + 1 WHERE number = {second}"))

        def lock_until_done(database: PostgresDatabase, first: int, second: int) -> None:
            database.again(lambda: lock(database, first, second))
            done.set()

        with ThreadPoolExecutor(2) as pool:
            first = pool.submit(lock_until_done, one, 1, 2)
            second = pool.submit(lock_until_done, two, 2, 1)
            first.result()
            second.result()
        assert sum(tries.values()) == 3
        with one.reading() as session:
            assert session.scalars(select(JobRow.beat)).all() == [2, 2]


def test_turns_and_priorities_are_as_by_one_server(address: str) -> None:
    with servers(address, 2) as databases:
        stores = [SqlJobStore(database) for database in databases]
        for number, priority in enumerate([Priority.BULK, *[Priority.INTERACTIVE] * 4]):
            for tenant in ("anvil", "loom"):
                asked = submission(str(number), tenant=tenant, priority=priority)
                stores[0].submit(asked, 100)
        begun = []
        for number in range(10):
            claim = stores[number % 2].claim("one", 30.0)
            assert claim is not None
            begun.append(claim.job.tenant[0] + claim.job.priority[0])
        assert " ".join(begun) == "ai li ai li ai li ab lb ai li"


def test_another_release_gets_no_work(address: str) -> None:
    with servers(address, 1) as (database,):
        SqlJobStore(database).submit(submission(), 10)
        other = SqlJobStore(database, release="9.9")
        with pytest.raises(NotReadyError, match=r"release \S+, and this one, 9\.9, gets no work"):
            other.claim("one", 30.0)
        migrate_server(address, "9.9")
        assert other.claim("one", 30.0) is not None


def schema(connection: Connection) -> dict[str, list[list[str]]]:
    """Of each table what :func:`compare_metadata` does not look at."""
    look = inspect(connection)
    return {
        table: [
            sorted(str(one["sqltext"]) for one in look.get_check_constraints(table)),
            sorted(str(one["name"]) for one in look.get_indexes(table)),
            sorted(
                f"{one['name']} {one['type']} {getattr(one['type'], 'collation', None)}"
                for one in look.get_columns(table)
            ),
        ]
        for table in Base.metadata.tables
    }


def test_migrations_make_exactly_the_tables(own_address: str, postgres: PostgresServer) -> None:
    empty = postgres.empty_database()
    engines = [create_engine(Place.of(one).url) for one in (own_address, empty)]
    with engines[0].connect() as migrated, engines[1].begin() as made:
        assert compare_metadata(MigrationContext.configure(migrated), Base.metadata) == []
        Base.metadata.create_all(made)
        assert schema(migrated) == schema(made)
    for engine in engines:
        engine.dispose()
    postgres.drop(empty)


def test_numbers_and_sizes_are_wide_and_names_in_the_order_of_bytes(address: str) -> None:
    with psycopg.connect(address) as connection:
        narrow = connection.execute(
            "SELECT table_name, column_name FROM information_schema.columns"
            " WHERE table_schema = 'public' AND data_type IN ('integer', 'smallint')"
        ).fetchall()
        assert narrow == []
    with servers(address, 1) as (database,):
        store = SqlJobStore(database)
        for name in ("b", "B", "a", "é", "Z", "_"):
            store.submit(submission(name, asset=name), 100)
        with database.reading() as session:
            names = session.scalars(select(AssetRow.name).order_by(AssetRow.name)).all()
        assert names == sorted(names, key=str.encode)


def test_migrating_is_done_by_one_at_a_time(postgres: PostgresServer) -> None:
    address = postgres.empty_database()
    with ThreadPoolExecutor(4) as pool:
        told = sorted(pool.map(lambda _: migrate_server(address), range(4)))
    assert [line.partition(",")[0] for line in told] == [
        f"the database has schema {newest_schema()} already"
    ] * 3 + ["the database was empty"]
    postgres.drop(address)


def open_error(address: str) -> str:
    begun = time.monotonic()
    with pytest.raises(SettingsError) as refused:
        PostgresDatabase.open(address)
    assert time.monotonic() - begun < 15.0
    told = str(refused.value)
    assert "\n" not in told
    assert "; " in told  # the remedy
    return told


def test_a_database_that_will_not_do_is_refused_in_a_line(postgres: PostgresServer) -> None:
    assert "CREATE DATABASE" in open_error(postgres.address("nowhere"))
    assert "check the user" in open_error(
        postgres.address().replace("occluder@", "stranger:secret@")
    )
    assert "secret" not in open_error(postgres.address().replace("occluder@", "stranger:secret@"))
    assert "check that PostgreSQL runs" in open_error(
        f"postgresql://occluder@127.0.0.1:{free_port()}/occluder"
    )
    for slip in ("mysql://me@there/x", "occluder.db", ""):
        assert "postgresql://USER" in open_error(slip)

    latin = postgres.empty_database("ENCODING 'LATIN1' TEMPLATE template0")
    assert "LATIN1" in open_error(latin)
    postgres.drop(latin)


def test_rights_that_are_missing_are_told(postgres: PostgresServer, own_address: str) -> None:
    name = own_address.rpartition("/")[2]
    postgres.execute("CREATE ROLE guest LOGIN")
    guest = own_address.replace("occluder@", "guest@")
    assert "permission denied" in open_error(guest)  # of the tables
    postgres.execute(f"REVOKE CONNECT ON DATABASE {name} FROM PUBLIC")
    assert "GRANT CONNECT" in open_error(guest)
    empty = postgres.empty_database()
    with pytest.raises(SettingsError, match="GRANT CREATE"):
        migrate_server(empty.replace("occluder@", "guest@"))
    postgres.drop(empty)
    postgres.drop(own_address)
    postgres.execute("DROP ROLE guest")


def test_a_server_that_is_too_old_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "OLDEST", 99)
    assert "use 99 or newer" in open_error(address)


def test_a_schema_that_will_not_do_is_refused(postgres: PostgresServer, own_address: str) -> None:
    name = own_address.rpartition("/")[2]

    def has(schema: str, runs_from: str) -> None:
        postgres.execute(f"UPDATE alembic_version SET version_num = '{schema}'", name)
        postgres.execute(f"UPDATE deployment SET runs_from = '{runs_from}', release = '2.0'", name)

    empty = postgres.empty_database()
    assert "run 'occluder migrate' once" in open_error(empty)
    postgres.drop(empty)
    has("0011", "0011")
    assert "needs 00" in open_error(own_address)
    has("9999", "0012")
    PostgresDatabase.open(own_address).close()  # a release runs on the schema of the next one
    has("9999", "9000")
    assert "install 2.0" in open_error(own_address)
    with pytest.raises(SettingsError, match="of the newest release"):
        migrate_server(own_address)


@contextmanager
def pooler(address: str, mode: str) -> Iterator[str]:
    """The address of a PgBouncer before a database."""
    from tests.postgres import program

    bouncer = program("pgbouncer") or Path("/usr/sbin/pgbouncer")
    if not bouncer.exists():
        pytest.skip("PgBouncer is not installed: apt-get install pgbouncer")
    place = Place.of(address).url
    port = free_port()
    folder = Path(tempfile.mkdtemp(dir="/tmp"))
    folder.chmod(0o755)
    file = folder / "pgbouncer.ini"
    file.write_text(
        f"[databases]\n* = host={place.host} port={place.port} user=occluder\n"
        f"[pgbouncer]\nlisten_addr = 127.0.0.1\nlisten_port = {port}\nauth_type = any\n"
        f"pool_mode = {mode}\nunix_socket_dir =\n\n"
        "ignore_startup_parameters = extra_float_digits,options\n"
    )
    process = subprocess.Popen(
        [bouncer, "-q", file], stderr=subprocess.DEVNULL, user="postgres", extra_groups=[]
    )
    pooled = f"postgresql://occluder@127.0.0.1:{port}/{place.database}"
    try:
        until(lambda: reachable(pooled))
        yield pooled
    finally:
        process.terminate()
        process.wait()
        shutil.rmtree(folder)


def reachable(address: str) -> bool:
    try:
        psycopg.connect(address, connect_timeout=1).close()
    except psycopg.Error:
        return False
    return True


def test_a_pooler_in_transaction_mode_is_refused(address: str) -> None:
    with pooler(address, "transaction") as pooled:
        assert "pool_mode = session" in open_error(pooled)


def test_a_pooler_in_session_mode_will_do(address: str) -> None:
    with pooler(address, "session") as pooled, servers(pooled, 1) as (database,):
        assert SqlJobStore(database).submit(submission(), 10)[1]


def test_a_server_that_is_gone_is_told_and_found_again_without_a_restart() -> None:
    from tests.postgres import running_postgres

    with running_postgres(durable=True) as server, servers(server.database(), 1) as (database,):
        store = SqlJobStore(database)
        kept = [store.submit(submission(str(number)), 100)[0].id for number in range(10)]
        server.kill()
        with pytest.raises(NotReadyError, match="try again"):
            store.job(None, kept[0])
        with pytest.raises(NotReadyError, match="try again"):
            store.submit(submission("more"), 100)
        assert not database.is_sound()
        server.start()
        assert database.is_sound()
        assert [store.job(None, one).state for one in kept] == [JobState.QUEUED] * 10
        assert store.claim("one", 30.0) is not None


def test_a_lost_connection_leaves_nothing_half_done(postgres: PostgresServer, address: str) -> None:
    with servers(address, 1) as (database,):
        store = SqlJobStore(database)
        store.submit(submission(), 10)
        claim = store.claim("one", 30.0)
        assert claim is not None

        def cut_off() -> None:
            with database.writing() as session:
                session.execute(text("DELETE FROM jobs"))
                pid = session.scalar(text("SELECT pg_backend_pid()"))
                postgres.execute(f"SELECT pg_terminate_backend({pid})")
                session.execute(text("SELECT 1"))

        with pytest.raises(NotReadyError):
            cut_off()
        assert store.succeed(claim, results(), summary())


def test_what_is_told_is_heard_by_others_after_the_commit(address: str) -> None:
    heard: list[tuple[Topic, str]] = []
    listening = threading.Event()
    listener = Listener(Place.of(address), lambda *told: heard.append(told), listening.set)
    with servers(address, 1) as (database,), listener.running():
        assert listening.wait(10.0)
        store = SqlJobStore(database)
        job, _ = store.submit(submission(), 10)
        until(lambda: heard == [(Topic.QUEUED, "")])
        claim = store.claim("one", 30.0)
        assert claim is not None
        store.succeed(claim, results(), summary())
        until(lambda: heard[1:] == [(Topic.ENDED, job.id)])


def test_whoever_listens_hears_again_after_being_cut_off(
    postgres: PostgresServer, address: str
) -> None:
    heard: list[str] = []
    again = threading.Semaphore(0)
    listener = Listener(Place.of(address), lambda _, what: heard.append(what), again.release)
    name = address.rpartition("/")[2]
    with listener.running():
        assert again.acquire(timeout=10.0)
        postgres.execute(
            f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"
        )
        assert again.acquire(timeout=10.0)
        postgres.execute("SELECT pg_notify('occluder_ended', 'x')", name)
        until(lambda: heard == ["x"])


def test_time_is_that_of_the_server(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time", lambda: 5.0)
    with servers(address, 2) as (one, two):
        assert abs(one.clock() - two.clock()) < 0.5
        assert one.clock() > 1_700_000_000.0
        job, _ = SqlJobStore(one).submit(submission(), 10)
        assert abs(job.created - two.clock()) < 5.0


def test_a_pause_that_one_server_gives_holds_for_the_others(address: str) -> None:
    with servers(address, 2) as (one, two):
        first, second = SqlJobStore(one), SqlJobStore(two)
        first.submit(submission(attempts=3), 10)
        claim = first.claim("one", 30.0)
        assert claim is not None
        assert first.fail(claim, DIED, final=False) is JobState.QUEUED
        assert second.claim("two", 30.0) is None
        assert until(lambda: second.claim("two", 30.0)).job.attempt == 2
