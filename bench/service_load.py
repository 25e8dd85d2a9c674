"""The service under load: ``python -m bench.service_load [--only PART]``.

    load         64 clients post small meshes while a large one is worked on: errors, status calls
    memory       the server's memory over many tiny jobs
    upload       a large upload against a plain write to the same disk
    overhead     a result by HTTP against the same calls of the library, both warm
    connections  a thousand open connections beside those that ask
    throughput   jobs a second of 32 clients, against two processes that call the library
    storage      files and bytes that a small bunny leaves behind, by what is kept

A real server in a temporary folder, clients on the same machine: they share its processors.
``service_PART.csv`` hold the figures, ``service.md`` shows them all.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from http.client import HTTPConnection
from itertools import count
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

import simplifier
from bench.meshes import ASSETS, bumpy_sphere
from bench.record import Row, told, write_page, write_table
from bench.service_process import Served, served
from bench.times import met
from service.client import Client, ClientError
from service.engines.work.report_files import PICTURE_SIZE
from service.settings import processors

RESULTS = Path("bench/results")
CLIENTS = 64
LOAD_SECONDS = 40.0
STATUS_TARGET_MS = 50.0
OVERHEAD_TARGET_MS = 50.0
UPLOAD_MIB_TARGET = 200.0
CONNECTIONS = 1000
PROCESSES = 2
POSTERS = 32
THROUGHPUT_TARGET = 0.9
STORED = 12
MILLION_NIGHT_SECONDS = 8 * 3600.0
PUTS_TARGET, TERABYTES_TARGET = 150.0, 0.3
_REPEATS = 11
_BLOCK = 1 << 20
_PAUSE = 1.0  # seconds that a client waits where the queue is full
_TINY = {"resolution": 8, "moves": 0, "views": 4, "image": 32, "quads": 64, "lods": 1}
_QUICK = {"preset": "draft", "lods": 1}
_LARGE = {"preset": "best", "time_limit": 2.0 * LOAD_SECONDS}

_TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 {} 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def load_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Posts are answered 202 or 429, after which a client waits; the large job runs all along."""
    del arguments
    numbers = count(1)
    with served(queue_limit=200) as server, closing(Client(server.address)) as client:
        large = client.submit(_obj(bumpy_sphere(200_000)), name="large.obj", options=_LARGE)
        _until(lambda: client.job(large.id).state == "running")
        answers: Counter[str] = Counter()
        lock, stop = threading.Lock(), threading.Event()

        def post() -> None:
            with Client(server.address, patience=0.0) as poster:
                while not stop.is_set():
                    answer = _answer(poster, next(numbers))
                    with lock:
                        answers[answer] += 1
                    if answer == "429":
                        stop.wait(_PAUSE)

        with _polling(server.port, f"/v1/jobs/{large.id}") as poll:
            with ThreadPoolExecutor(CLIENTS) as pool:
                for _ in range(CLIENTS):
                    pool.submit(post)
                time.sleep(LOAD_SECONDS)
                stop.set()
            poll.send(None)
            waits = sorted(poll.recv())
        state = client.job(large.id).state
        errors = sum(number for name, number in answers.items() if name not in ("taken", "429"))
        done = sum(1 for job in client.jobs() if job.state == "succeeded")
    p99 = _share(waits, 0.99)
    yield {
        "clients": CLIENTS, "seconds": LOAD_SECONDS, "large_job": state, "taken": answers["taken"],
        "answered_429": answers["429"], "errors": errors, "done_meanwhile": done,
        "status_calls": len(waits), "status_p50_ms": _share(waits, 0.5), "status_p99_ms": p99,
        "status_max_ms": waits[-1], "target_ms": STATUS_TARGET_MS,
        "target": met(errors == 0 and p99 < STATUS_TARGET_MS),
    }  # fmt: skip


def memory_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """The server's resident memory after so many jobs; growth after the first quarter counts."""
    marks = {round(arguments.jobs * share / 8) for share in range(1, 9)}
    begin, base = time.perf_counter(), 0.0
    with served() as server, closing(Client(server.address)) as client:
        yield {"jobs": 0, "seconds": 0.0, "server_mib": server.resident_mib}

        def run(number: int) -> None:
            mesh = _TETRAHEDRON.format(1.0 + number / 1e6).encode()
            client.wait(client.submit(mesh, name="tiny.obj", options=_TINY).id)

        with ThreadPoolExecutor(8) as pool:
            for done, _ in enumerate(pool.map(run, range(arguments.jobs)), 1):
                if done in marks:
                    now = server.resident_mib
                    base = base or (now if done >= arguments.jobs / 4 else 0.0)
                    yield {
                        "jobs": done, "seconds": time.perf_counter() - begin, "server_mib": now,
                        "growth_mib": now - base if base else None,
                    }  # fmt: skip


def upload_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Random bytes, which no disk can shorten much; the job that comes of them fails."""
    size = round(arguments.gib * (1 << 30))
    with served() as server:
        source = server.folder / "large.stl"
        plain = _written(source, size)
        before = server.resident_mib
        with closing(Client(server.address)) as client:
            begin = time.perf_counter()
            client.submit(source)
            sent = time.perf_counter() - begin
        yield {
            "gib": arguments.gib, "plain_write_mib_s": size / _BLOCK / plain,
            "upload_mib_s": size / _BLOCK / sent, "share": plain / sent, "idle_mib": before,
            "peak_mib": server.peak_mib, "target_mib": UPLOAD_MIB_TARGET,
            "target": met(server.peak_mib < UPLOAD_MIB_TARGET),
        }  # fmt: skip


def overhead_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """From bytes to the occluder's bytes; both write all formats, the mesh, the report and all
    pictures."""
    del arguments
    for triangles, preset in ((500, "draft"), (5000, "balanced")):
        with served(workers=1, draw_at_once=True) as server:
            by_http, by_library = [], []
            for number in range(_REPEATS + 3):
                data = _obj(bumpy_sphere(triangles + 2 * number))
                by_http.append(_by_http(server, data, preset))
                by_library.append(_by_library(data, preset))
        # The first of both load and compile.
        http_ms, library_ms = (1000.0 * statistics.median(s[3:]) for s in (by_http, by_library))
        yield {
            "triangles": triangles, "preset": preset, "library_ms": library_ms, "http_ms": http_ms,
            "overhead_ms": http_ms - library_ms, "target_ms": OVERHEAD_TARGET_MS,
            "target": met(http_ms - library_ms <= OVERHEAD_TARGET_MS),
        }  # fmt: skip


def connection_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Connections that have asked once and stay open; then one more asks, and all ask again."""
    del arguments
    with served() as server, ExitStack() as opened:
        lines = [
            opened.enter_context(closing(_line_that_stays(server.port))) for _ in range(CONNECTIONS)
        ]
        first = sum(_is_well(line) for line in lines)
        with _polling(server.port, "/v1/jobs") as poll:
            time.sleep(5.0)
            poll.send(None)
            waits = sorted(poll.recv())
        again = sum(_is_well(line) for line in lines)
        yield {
            "connections": CONNECTIONS, "answered": first, "answered_again": again,
            "list_p50_ms": _share(waits, 0.5), "list_p99_ms": _share(waits, 0.99),
            "server_mib": server.resident_mib, "target": met(first == again == CONNECTIONS),
        }  # fmt: skip


def throughput_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Small bunnies, no two of them alike, in turns by HTTP and by the library.

    Both give a GLB and the report; the library's processes are as warm as the service's workers,
    and as many, with as many threads.  ``share`` is of jobs a second; ``processor_share`` compares
    the processor time of a job, which tells the same where other work slows the machine.
    """
    numbers = count(1)
    bunny = simplifier.load(ASSETS / "bunny_4968.ply")

    def meshes() -> list[bytes]:
        return [_obj(bunny, 1.0 + next(numbers) / 1e5) for _ in range(POSTERS)]

    with ExitStack() as opened:
        servers = {
            pages: opened.enter_context(served(workers=PROCESSES, draw_at_once=at_once))
            for pages, at_once in (("with each job", True), ("when asked for", False))
        }
        callers = [opened.enter_context(_calling()) for _ in range(PROCESSES)]
        for server in servers.values():
            _all_by_http(server, meshes()[: 2 * PROCESSES])  # the first of each loads
        library: list[tuple[float, float]] = []
        service: dict[str, list[tuple[float, float]]] = {pages: [] for pages in servers}
        for _ in range(arguments.rounds):
            for pages, server in servers.items():
                before = server.processor_seconds
                seconds = _all_by_http(server, meshes())
                service[pages].append((seconds, server.processor_seconds - before))
            library.append(_all_by_library(callers, meshes()))
    by_library, library_cost = _rate_and_cost(library)
    for pages, measured in service.items():
        by_http, http_cost = _rate_and_cost(measured)
        shares = [library[number][0] / one[0] for number, one in enumerate(measured)]
        share = statistics.median(shares)
        yield {
            "pages": pages, "clients": POSTERS, "rounds": arguments.rounds,
            "library_jobs_s": by_library, "http_jobs_s": by_http, "share": share,
            "least": min(shares), "most": max(shares), "library_processor_s": library_cost,
            "http_processor_s": http_cost, "processor_share": library_cost / http_cost,
            "target_share": THROUGHPUT_TARGET, "target": met(share >= THROUGHPUT_TARGET),
        }  # fmt: skip


def storage_rows(arguments: argparse.Namespace) -> Iterator[Row]:
    """Bunnies of other sizes, with the options as by default: a file is a put to a bucket.

    ``puts_s`` and ``terabytes`` are those of a million such jobs in a night of eight hours.  What
    one asks for on demand comes at its end: of a process that has to start, and of one that is
    warm, beside a page.
    """
    del arguments
    bunny = simplifier.load(ASSETS / "bunny_4968.ply")
    numbers = count(1)
    for keep, settings in (
        ("all, with pages", {"draw_at_once": True}), ("all", {}), ("lean", {"keep": "lean"}),
    ):  # fmt: skip
        with served(**settings) as server, closing(Client(server.address)) as client:
            sent, jobs = 0, []
            for _ in range(STORED):
                mesh = _ply(bunny, 1.0 + next(numbers) / 1e5)
                sent += len(mesh)
                jobs.append(client.wait(client.submit(mesh, name="bunny.ply").id))
            blobs = [path for path in (server.folder / "data/blobs").rglob("*") if path.is_file()]
            stored = sum(path.stat().st_size for path in blobs)
            on_disk = sum(path.stat().st_blocks * 512 for path in blobs)
            database = (server.folder / "data/occluder.db").stat().st_size
            first, *later = (_demanded(client, job.id, "lod0.obj") for job in jobs)
            page = statistics.median(_demanded(client, job.id, "report.html") for job in jobs)
        files, size = len(blobs) / STORED, stored / STORED
        puts, terabytes = files * 1e6 / MILLION_NIGHT_SECONDS, size * 1e6 / 1e12
        yield {
            "keep": keep, "jobs": STORED, "files": files, "kilobytes": size / 1e3,
            "sent_kilobytes": sent / STORED / 1e3, "on_disk_kilobytes": on_disk / STORED / 1e3,
            "database_kilobytes": database / STORED / 1e3, "puts_s": puts, "terabytes": terabytes,
            "first_file_ms": first, "file_ms": statistics.median(later), "page_ms": page,
            "target": met(puts < PUTS_TARGET and terabytes < TERABYTES_TARGET),
        }  # fmt: skip


PARTS: dict[str, Callable[[argparse.Namespace], Iterator[Row]]] = {
    "load": load_rows,
    "memory": memory_rows,
    "upload": upload_rows,
    "overhead": overhead_rows,
    "connections": connection_rows,
    "throughput": throughput_rows,
    "storage": storage_rows,
}


def _answer(client: Client, number: int) -> str:
    """``taken``, or the status or the kind of error."""
    mesh = _TETRAHEDRON.format(1.0 + number / 1e6).encode()
    try:
        client.submit(mesh, name="small.obj", options=_TINY)
    except ClientError as error:
        return str(error.problem.status)
    return "taken"


class _polling:
    """A process that asks one thing again and again; send None for the milliseconds of each."""

    def __init__(self, port: int, path: str) -> None:
        context = get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_poll, args=(there, port, path))

    def __enter__(self) -> Connection:
        self._process.start()
        self._here.recv()  # it asks
        return self._here

    def __exit__(self, *error: object) -> None:
        self._process.terminate()
        self._process.join()


def _poll(pipe: Connection, port: int, path: str) -> None:
    line = HTTPConnection("127.0.0.1", port, timeout=30)
    waits: list[float] = []
    pipe.send(None)
    while not pipe.poll(0.01):
        begin = time.perf_counter()
        line.request("GET", path)
        answer = line.getresponse()
        answer.read()
        waits.append(1000.0 * (time.perf_counter() - begin))
        if answer.status != 200:
            raise RuntimeError(f"{path} answers {answer.status}")
    pipe.send(waits)


def _by_http(server: Served, data: bytes, preset: str) -> float:
    """As the README's curl: one request, answered with the occluder."""
    begin = time.perf_counter()
    line = HTTPConnection("127.0.0.1", server.port, timeout=120)
    with closing(line):
        line.request(
            "POST", f"/v1/occluders?filename=mesh.obj&preset={preset}", data,
            {"Accept": "model/gltf-binary", "Prefer": "wait=60"},
        )  # fmt: skip
        answer = line.getresponse()
        body = answer.read()
    if answer.status != 200:
        raise RuntimeError(body.decode())
    return time.perf_counter() - begin


def _by_library(data: bytes, preset: str) -> float:
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "mesh.obj").write_bytes(data)
        options = simplifier.SimplifyOptions.of({"preset": preset, "lods": 3})
        simplifier.check_file(folder / "mesh.obj", options, pictures=True, viewing=True)
        mesh = simplifier.load(folder / "mesh.obj")
        product = simplifier.simplify(mesh, options).measure()
        for suffix in simplifier.OCCLUDER_SUFFIXES:
            product.save(folder / f"occluder{suffix}")
        simplifier.save_for_viewing(mesh, folder / "original.glb")
        simplifier.Viewpoint(mesh, size=PICTURE_SIZE, up=options.up).picture(product.occluder)
        report = product.report()
        (folder / "report.json").write_text(json.dumps(report, indent=2))
        product.write_pictures(folder, "mesh.obj", report)
        (folder / "occluder.glb").read_bytes()
    return time.perf_counter() - begin


def _all_by_http(server: Served, meshes: Sequence[bytes]) -> float:
    """A client each; the seconds until the last one has its occluder and its report."""

    def one(number: int) -> None:
        with Client(server.address) as client:
            job = client.wait(client.submit(meshes[number], name="bunny.obj", options=_QUICK).id)
            target = server.folder / f"{number}.glb"
            client.download(job.id, target)
            if not target.stat().st_size or client.result(job.id).report is None:
                raise RuntimeError("a result is not whole")

    begin = time.perf_counter()
    with ThreadPoolExecutor(POSTERS) as pool:
        list(pool.map(one, range(len(meshes))))
    return time.perf_counter() - begin


def _rate_and_cost(measured: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Jobs a second and processor seconds a job, of rounds that each took so much of both."""
    seconds, costs = zip(*measured, strict=True)
    return POSTERS / statistics.median(seconds), statistics.median(costs) / POSTERS


def _all_by_library(callers: Sequence[Connection], meshes: Sequence[bytes]) -> tuple[float, float]:
    """The seconds until the last process is done, and the processor seconds of all."""
    begin = time.perf_counter()
    for number, caller in enumerate(callers):
        caller.send(meshes[number :: len(callers)])
    costs = [caller.recv() for caller in callers]
    return time.perf_counter() - begin, sum(costs)


@contextmanager
def _calling() -> Iterator[Connection]:
    """A process that makes occluders of the meshes that it is sent, with its share of threads."""
    context = get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_call, args=(there,))
    process.start()
    try:
        here.recv()  # it is warm
        yield here
    finally:
        process.terminate()
        process.join()


def _call(pipe: Connection) -> None:
    os.environ["OCCLUDER_THREADS"] = str(max(1, processors() // PROCESSES))
    simplifier.warm_up()
    options = simplifier.SimplifyOptions.of(_QUICK)
    pipe.send(None)
    while True:
        meshes, before = pipe.recv(), time.process_time()
        for data in meshes:
            with tempfile.TemporaryDirectory() as place:
                file = Path(place) / "bunny.obj"
                file.write_bytes(data)
                made = simplifier.simplify(simplifier.load(file), options)
                made.save(file.with_suffix(".glb"))
                file.with_suffix(".json").write_text(json.dumps(made.measure().report()))
        pipe.send(time.process_time() - before)


def _written(path: Path, size: int) -> float:
    """Write random bytes to a file and to the disk; the seconds that writing took."""
    block = os.urandom(_BLOCK)
    begin = time.perf_counter()
    with path.open("wb") as file:
        for _ in range(size // _BLOCK):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
    return time.perf_counter() - begin


def _line_that_stays(port: int) -> HTTPConnection:
    """An open connection, which is not opened again where the server closes it."""
    line = HTTPConnection("127.0.0.1", port, timeout=30)
    line.connect()
    line.auto_open = 0
    return line


def _is_well(line: HTTPConnection) -> bool:
    line.request("GET", "/healthz")
    answer = line.getresponse()
    answer.read()
    return answer.status == 200


def _obj(mesh: simplifier.TriangleMesh, size: float = 1.0) -> bytes:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in size * mesh.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    return "\n".join(lines).encode()


def _ply(mesh: simplifier.TriangleMesh, size: float) -> bytes:
    """As the asset is: binary, of 32 bits."""
    rows = np.empty(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, mesh.faces
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return header.encode() + (size * mesh.vertices).astype("<f4").tobytes() + rows.tobytes()


def _demanded(client: Client, job_id: str, name: str) -> float:
    """Milliseconds until a file of a job is here."""
    with tempfile.TemporaryDirectory() as place:
        begin = time.perf_counter()
        client.fetch(job_id, name, Path(place) / "file")
        return 1000.0 * (time.perf_counter() - begin)


def _until(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("it took too long")
        time.sleep(0.05)


def _share(ordered: Sequence[float], share: float) -> float:
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.service_load")
    parser.add_argument("--only", choices=PARTS, action="append")
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--gib", type=float, default=1.0)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    command = "python -m bench.service_load " + " ".join(sys.argv[1:])
    for name in arguments.only or PARTS:
        rows = []
        for row in PARTS[name](arguments):
            print(f"{name}: {told(row)}", flush=True)
            rows.append(row)
        write_table(RESULTS / f"service_{name}.csv", rows, command.strip())
    write_page(RESULTS, "service", PARTS)


if __name__ == "__main__":
    main()
