"""What one and several servers bear: ``python -m bench.scale [--only PART] [--jobs N]``.

    claims    claims with their endings a second on PostgreSQL, with a million jobs waiting
    submit    a submission, with as many waiting, on PostgreSQL and in the embedded file
    turns     a single job of one tenant behind 100,000 of another: in which claim it is begun
    embedded  the file alone: jobs a second, and rows by which what is listed becomes slow
    workers   jobs a second by 1, 2 and 4 'occluder work': such as wait half a second, and bunnies
    ray       the same by a Ray node of as many processors; a job alone, the first there and later
    million   processors for a million assets in eight hours: a simulation of the figures of others

A PostgreSQL server of its own in a temporary folder, which flushes each commit.  Stores are called
as servers call them, without meshes and work.  ``scale_PART.csv`` hold the figures.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from sqlalchemy import text

from bench.farm import Farm, processors_for
from bench.meshes import ASSETS
from bench.record import Row, read_table, told, write_page, write_table
from service.jobs.job import Blob, JobFile, JobKind, Submission, Summary
from service.jobs.stores import JobFilter
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.postgres import PostgresDatabase
from service.storage.sqlite import SqliteDatabase
from tests.cluster.machines import Cluster
from tests.cluster.ray_nodes import Dispatch, RayNodes
from tests.faults.serving import LIGHT_WORK, path_of_processes
from tests.postgres import PostgresServer, running_postgres
from tests.service.real import BOX
from tests.waiting import BUSY, until

RESULTS = Path("bench/results")
CLIENTS = (1, 2, 4, 8)
SECONDS = 10.0
OF_A_MILLION = (
    "bunny_4968.ply",
    "level_dungeon.ply",
    "building_fzk_haus.glb",
    "broken_truck.ply",
    "tree_aspen_with_leaves.glb",
    "sponza_dabrovic.glb",
)
"""Assets as a game has them: of some thousands to tens of thousands of triangles."""

_QUEUE = 10**9
_SUMMARY = Summary(64, 5000, 3, 1.5, 0.999, 0.9)
_COLUMNS = (
    "tenant, kind, state, name, options, version, work_key, created, attempt, attempts, priority,"
    " cancel_asked, beat, lease_seconds, due, tallied"
)


def submission(number: int, tenant: str = "studio") -> Submission:
    mesh = JobFile("input/mesh.glb", Blob(f"{number:064x}", 100_000), "model/gltf-binary", True)
    return Submission(
        tenant=tenant, kind=JobKind.OCCLUDER, name="castle.glb", options={"budget": 64},
        inputs=(mesh,), version="1.0", may_reuse=False,
    )  # fmt: skip


def claim_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Each client is a process: it claims a job, ends it with a result of two files, and again."""
    with running_postgres(durable=True) as server:
        address = filled(server, arguments.jobs)
        for clients in CLIENTS:
            counts = _at_once(clients, _claim_for, address, SECONDS)
            rate = sum(counts) / SECONDS
            yield {"waiting": arguments.jobs, "clients": clients, "claims_s": round(rate, 1),
                   "ms_each": round(1000.0 * clients / rate, 2)}  # fmt: skip


def submit_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    with running_postgres(durable=True) as server, tempfile.TemporaryDirectory() as folder:
        address = filled(server, arguments.jobs)
        with closing(PostgresDatabase.open(address)) as database:
            yield {"database": "PostgreSQL", "waiting": arguments.jobs, **_submitting(database)}
        with closing(SqliteDatabase.open(Path(folder) / "occluder.db")) as database:
            for waiting in (0, arguments.jobs):
                _fill(database, waiting)
                yield {"database": "file", "waiting": waiting, **_submitting(database)}


def turn_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    with running_postgres(durable=True) as server:
        address = filled(server, 100_000)
        with closing(PostgresDatabase.open(address)) as database:
            jobs = SqlJobStore(database)
            for _ in range(10):
                jobs.claim("one", 30.0)
            mine, _ = jobs.submit(submission(1, "rival"), _QUEUE)
            place, claims = jobs.place(mine.number), 0
            while True:
                claims += 1
                claim = jobs.claim("one", 30.0)
                assert claim is not None
                if claim.job.id == mine.id:
                    break
            yield {"waiting": 100_000, "place": place, "begun_in_claim": claims}


def embedded_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        for waiting in (1_000, 100_000, 1_000_000):
            file = Path(folder) / f"{waiting}.db"
            with closing(SqliteDatabase.open(file)) as database:
                _fill(database, waiting)
                jobs = SqlJobStore(database)
                yield {
                    "rows": waiting,
                    "jobs_s": round(_claiming(jobs, 3.0) / 3.0, 1),
                    "list_ms": _median_ms(
                        lambda jobs=jobs: jobs.jobs("studio", JobFilter(), before=None, limit=50)
                    ),
                    "queue_ms": _median_ms(lambda jobs=jobs: jobs.queue("studio", 50)),
                    "counts_ms": _median_ms(jobs.counts),
                    "mib": round(file.stat().st_size / 2**20, 1),
                }


def worker_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Two servers, a bucket, and hosts with a worker each, all on this machine."""
    mesh = (ASSETS / "bunny_4968.ply").read_bytes()
    kinds = {
        "waiting 0.5 s": ({"FAULTS_WORK": str(LIGHT_WORK)}, 40, _slow_box, "filename=box.obj"),
        "bunny, balanced": ({}, 8, lambda number: mesh, "filename=bunny.ply&lods=1"),
    }
    for kind, (variables, each, body, query) in kinds.items():
        for hosts in (1, 2, 4):
            with tempfile.TemporaryDirectory() as folder:
                path = path_of_processes(Path(folder) / "declared")
                cluster = Cluster(path, Path(folder), hosts=hosts, **variables)
                with closing(cluster):
                    jobs = each * hosts if variables else each
                    yield {"jobs": kind, "workers": hosts, **_working(cluster, jobs, body, query)}


def ray_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """A server, a bucket, a dispatcher, and a Ray node, all on this machine."""
    for workers in (1, 2, 4):
        with _farm(workers) as (cluster, dispatch):
            if workers == 1:
                seconds = [_alone(cluster, number) for number in range(21)]
                yield {"jobs": "alone", "workers": 1, "count": 1, "first_s": round(seconds[0], 2),
                       "later_s": round(statistics.median(seconds[1:]), 3)}  # fmt: skip
            _ended(cluster, [_post(cluster, 1000 + number, 3.0) for number in range(workers)])
            ids = [_post(cluster, 2000 + number, 0.5) for number in range(40 * workers)]
            _ended(cluster, ids)
            first, last = cluster.rows(
                f"SELECT min(started), max(ended) FROM jobs WHERE number > {_number(cluster, ids)}"
            )[0]
            yield {"jobs": "waiting 0.5 s", "workers": workers, "count": len(ids),
                   "jobs_s": round(len(ids) / (last - first), 2)}  # fmt: skip
            assert dispatch.stop() == 0


@contextmanager
def _farm(processors: int) -> Iterator[tuple[Cluster, Dispatch]]:
    with ExitStack() as parts:
        folder = Path(parts.enter_context(tempfile.TemporaryDirectory()))
        path = path_of_processes(folder / "declared")
        cluster = Cluster(path, folder, hosts=0, servers=1, engine="ray",
                          FAULTS_WORK=str(LIGHT_WORK))  # fmt: skip
        parts.callback(cluster.close)
        ray = RayNodes(path, cluster.shared, more=0, processors=processors)
        parts.callback(ray.close)
        dispatch = Dispatch(path, folder / "dispatch.log", cluster.shared | ray.joining)
        parts.callback(dispatch.kill)
        yield cluster, dispatch.start()


def _alone(cluster: Cluster, number: int) -> float:
    """Seconds from its submission to its end."""
    job_id = _post(cluster, number, 0.0)
    _ended(cluster, [job_id])
    ((seconds,),) = cluster.rows(f"SELECT ended - created FROM jobs WHERE id = '{job_id}'")
    return float(seconds)


def _post(cluster: Cluster, number: int, seconds: float) -> str:
    body = f"# occupy {seconds}\n# {number}\n".encode() + BOX
    answer = cluster.post("/v1/occluders?filename=box.obj", body)
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def _ended(cluster: Cluster, ids: Sequence[str]) -> None:
    listed = ", ".join(f"'{one}'" for one in ids)
    still = f"SELECT count(*) FROM jobs WHERE ended IS NULL AND id IN ({listed})"
    until(lambda: cluster.rows(still) == [(0,)], 600.0)


def _number(cluster: Cluster, ids: Sequence[str]) -> int:
    """That of the job before them."""
    ((number,),) = cluster.rows(f"SELECT number FROM jobs WHERE id = '{ids[0]}'")
    return int(number) - 1


def million_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Processor time of jobs is measured here; the rest is what the parts before have written."""
    claims, ray = _figures("claims"), _figures("ray")
    database = min(1.0 / float(row["claims_s"]) for row in claims)
    overhead = float(next(row["later_s"] for row in ray if row["later_s"]))
    for preset in ("draft", "balanced", "best"):
        seconds = [_processor_seconds(name, preset) for name in OF_A_MILLION]
        farm = Farm(seconds, overhead, database)
        processors, night = processors_for(farm, 1_000_000, 8.0)
        yield {
            "preset": preset, "job_s": round(statistics.mean(seconds), 2),
            "overhead_s": overhead, "database_ms": round(1000.0 * database, 1),
            "processors": processors, "hours": round(night.hours, 2),
            "repeated": night.repeated, "database_busy": round(night.database_busy, 2),
        }  # fmt: skip


def _figures(part: str) -> list[dict[str, str]]:
    file = RESULTS / f"scale_{part}.csv"
    if not file.exists():
        sys.exit(f"the simulation needs the figures of another part: --only {part} --only million")
    table = read_table(file)
    return [dict(zip(table.columns, row, strict=True)) for row in table.rows]


def _processor_seconds(name: str, preset: str) -> float:
    """Of a job as the service does it: read, simplified, measured and saved, by one thread."""
    script = (
        "import sys, time, simplifier\n"
        "def once(seed):\n"
        "    begun = time.process_time()\n"
        "    options = simplifier.SimplifyOptions(preset=sys.argv[2], seed=seed)\n"
        "    made = simplifier.simplify(simplifier.load(sys.argv[1]), options)\n"
        "    made.measure().report()\n"
        "    return time.process_time() - begun\n"
        "once(0)\n"
        "print(once(1))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(ASSETS / name), preset], check=True, text=True,
        stdout=subprocess.PIPE, env={**os.environ, "OCCLUDER_THREADS": "1"},
    )  # fmt: skip
    return float(done.stdout)


def _slow_box(number: int) -> bytes:
    return f"# occupy 0.5\n# {number}\n".encode() + BOX


def _working(cluster: Cluster, jobs: int, body: Callable[[int], bytes], query: str) -> Row:
    """From the first job that is begun, when all of them wait, to the last that ends."""
    for host in cluster.hosts:
        until(lambda: "ready for jobs" in host.log, BUSY)  # noqa: B023
        host.tell(signal.SIGSTOP)
    for number in range(jobs):
        answer = cluster.post(f"/v1/occluders?{query}&seed={number}", body(number))
        assert answer.status_code == 202, answer.text
    for host in cluster.hosts:
        host.tell(signal.SIGCONT)
    open_jobs = "SELECT count(*) FROM jobs WHERE ended IS NULL"
    while cluster.rows(open_jobs) != [(0,)]:
        time.sleep(0.2)
    first, last = cluster.rows("SELECT min(started), max(ended) FROM jobs")[0]
    return {"count": jobs, "jobs_s": round(jobs / (last - first), 2)}


PARTS: dict[str, Callable[[argparse.Namespace], Iterator[Row]]] = {
    "claims": claim_rows,
    "submit": submit_rows,
    "turns": turn_rows,
    "embedded": embedded_rows,
    "workers": worker_rows,
    "ray": ray_rows,
    "million": million_rows,
}


def filled(server: PostgresServer, jobs: int) -> str:
    """The address of a database with so many jobs waiting, all of one tenant."""
    address = server.database()
    with closing(PostgresDatabase.open(address)) as database:
        _fill(database, jobs)
    server.execute("VACUUM ANALYZE", address.rpartition("/")[2])
    return address


def _fill(database: Database, count: int) -> None:
    """Copies of a job, with a file each."""
    if not count:
        return
    store = SqlJobStore(database)
    first, _ = store.submit(submission(0), _QUEUE)
    name = "%d" if not database.shared else None
    new_id = "printf('%032x', n + :offset)" if name else "lpad(to_hex(n + :offset), 32, '0')"
    with database.writing() as session:
        if database.shared:
            session.execute(text("SET LOCAL statement_timeout = 0"))
        numbers = "WITH RECURSIVE n(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM n WHERE n < :count)"
        session.execute(
            text(
                f"{numbers} INSERT INTO jobs (id, {_COLUMNS})"
                f" SELECT {new_id}, {_COLUMNS} FROM jobs CROSS JOIN n WHERE jobs.id = :id"
            ),
            {"count": count - 1, "offset": 1 << 20, "id": first.id},
        )
        session.execute(
            text(
                "INSERT INTO job_files (job_number, name, digest, size, media_type, is_input)"
                " SELECT number, 'input/mesh.glb', :digest, 100000, 'model/gltf-binary', :yes"
                " FROM jobs WHERE number > :first"
            ),
            {"digest": "0" * 64, "yes": True, "first": first.number},
        )
        session.execute(text("UPDATE lines SET waiting = :count"), {"count": count})


def _submitting(database: Database) -> Row:
    jobs = SqlJobStore(database)
    numbers = iter(range(1, 10**6))
    return {
        "submit_ms": _median_ms(lambda: jobs.submit(submission(next(numbers)), _QUEUE)),
        "refusal_ms": _median_ms(lambda: jobs.check_room("studio", _QUEUE)),
    }


def _median_ms(call: Callable[[], object], times: int = 21) -> float:
    seconds = []
    for _ in range(times):
        begun = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - begun)
    return round(1000.0 * statistics.median(seconds), 2)


def _claim_for(address: str, seconds: float, ready: object) -> int:
    with closing(PostgresDatabase.open(address)) as database:
        jobs = SqlJobStore(database)
        jobs.counts()
        ready.wait()  # type: ignore[attr-defined]
        return _claiming(jobs, seconds)


def _claiming(jobs: SqlJobStore, seconds: float) -> int:
    """Claims that were ended in this time."""
    count, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        claim = jobs.claim("bench", 30.0)
        assert claim is not None
        files = [
            JobFile(name, Blob(f"{claim.job.number:x}".zfill(64), 1000), "application/octet-stream")
            for name in ("occluder.glb", "report.json")
        ]
        assert jobs.succeed(claim, files, _SUMMARY)
        count += 1
    return count


def _run(
    work: Callable[..., int], arguments: Sequence[object], ready: object, answers: object
) -> None:
    answers.put(work(*arguments, ready))  # type: ignore[attr-defined]


def _at_once(count: int, work: Callable[..., int], *arguments: object) -> list[int]:
    """What as many processes give that begin at the same moment."""
    context = multiprocessing.get_context("spawn")
    ready, answers = context.Barrier(count), context.Queue()
    processes = [
        context.Process(target=_run, args=(work, arguments, ready, answers)) for _ in range(count)
    ]
    for process in processes:
        process.start()
    found = [answers.get() for _ in processes]
    for process in processes:
        process.join()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.scale")
    parser.add_argument("--only", choices=PARTS, action="append")
    parser.add_argument("--jobs", type=int, default=1_000_000)
    arguments = parser.parse_args()
    command = "python -m bench.scale " + " ".join(sys.argv[1:])
    for name in arguments.only or PARTS:
        rows = []
        for row in PARTS[name](arguments):
            print(f"{name}: {told(row)}", flush=True)
            rows.append(row)
        write_table(RESULTS / f"scale_{name}.csv", rows, command.strip())
    write_page(RESULTS, "scale", PARTS)


if __name__ == "__main__":
    main()
