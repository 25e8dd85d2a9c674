"""Hashes of all that users get, to show that a change of the code has changed nothing else.

    python -m bench.fingerprints                    # write bench/results/fingerprints.csv
    python -m bench.fingerprints --check            # make them anew and name those that differ

It goes in by the doors that users have: the command line and HTTP.  Occluders count by their bytes;
reports, tables and pages without what differs from run to run: times, dates and addresses.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from bench.machine import ROOT
from bench.meshes import ASSETS

COMMAND = (sys.executable, "-m", "simplifier")
KEPT = ROOT / "bench" / "results" / "fingerprints.csv"

_TIMES = frozenset({
    "timings", "made", "created", "queued", "started", "ended", "finished", "expires", "seconds",
    "machine", "host", "cull_ms", "cull_seconds", "duration", "date", "id", "job", "job_id",
    "links", "href", "run", "created_at", "started_at", "finished_at", "queued_at", "ended_at",
    "updated", "milliseconds", "time", "times", "reused", "link", "seconds_a_cell",
    "request_id",
})  # fmt: skip
"""Keys whose values are times, dates, or names that a server draws at random."""

_VOLATILE = (
    (re.compile(r"\b\d[\d.,]*\s?(?:ms|s|min|h|GiB|MiB)\b"), "TIME"),
    (
        re.compile(r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|\+00:00| UTC)?)?"),
        "DATE",
    ),
    (re.compile(r"\b\d{1,2} [A-Z][a-z]+ 20\d\d\b"), "DATE"),  # 20 November 2026
    (re.compile(r"(?<=│) +\d+\.\d +(?=│)"), "TIME"),  # in a table's column of seconds
    (re.compile("─+"), "─"),  # as wide as a time is long
    (re.compile(r"width: [\d.]+%"), "WIDTH"),  # of a bar of time
    (re.compile(r"data:image/png;base64,[A-Za-z0-9+/=]+"), "PICTURE"),
    (re.compile(r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}"), "ID"),
    (re.compile(r"\b[0-9a-f]{32}\b"), "ID"),
)

CASES = (
    ("bunny_4968.ply", "--ground --budget 53", ".glb"),
    ("bunny_4968.ply", "--ground --budget 53 --preset draft --sides single", ".obj"),
    ("bunny_4968.ply", "--ground --lods 3", ".glb"),
    ("bunny_4968.ply", "--conservative --smallest-hole 0.01", ".ply"),
    ("bunny_4968.ply", "--ground --trim area --alpha 0.01 --moves 0 --as-quads", ".off"),
    ("bunny_4968.ply", "--error-bounds 0.004,0.009 --viewers above", ".occ"),
    ("bunny_69k.ply", "--smallest-hole 0.02 --seed 7", ".stl"),
    ("buddha_113k.ply", "--budget 30", ".glb"),
    ("dragon_871k.ply", "--budget 36 --preset draft", ".occ"),
    ("terrain_jacksboro_60160.ply", "--up z --ground --budget 23", ".glb"),
    ("machine_anymal_kinova_395k.glb", "--up z --budget 36 --preset draft", ".glb"),
    ("tree_aspen_with_leaves.glb", "--preset draft", ".tres"),
    ("tree_aspen_with_leaves.glb", "--preset draft --transparent keep --min-precision 0.9", ".glb"),
    ("cad_reciprocating_saw.glb", "--preset draft --with-original godot", ".glb"),
    ("building_fzk_haus.glb", "--up z --ground --error-bound 0.5 --preset draft", ".glb"),
    ("broken_truck.ply", "--preset draft --shrink 0.05", ".obj"),
    ("broken_DERIVED_truck_nan.ply", "--preset draft", ".ply"),
    ("broken_openscad_nonmanifold.ply", "--preset draft", ".glb"),
    ("level_dungeon.ply", "--up z --preset draft --exact", ".glb"),
)
"""An asset, options as they are typed, and the format."""


@dataclass(frozen=True)
class Ran:
    """What a command printed and returned, and the folder that it wrote to."""

    status: int
    out: str
    errors: str
    folder: Path


def main() -> None:
    """Write the fingerprints, or name those that differ; then the exit status is 1."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with what was kept")
    parser.add_argument("--only", default="", help="work whose name contains this")
    parser.add_argument("--file", type=Path, default=KEPT)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = fingerprints(Path(folder), arguments.only)
    if not arguments.check:
        _write(arguments.file, found)
        print(f"{arguments.file.name}: {len(found)} fingerprints")
        return
    kept = {
        name: value
        for name, value in _read(arguments.file).items()
        if arguments.only in name.split(": ")[0]
    }
    differing = sorted(name for name in {*kept, *found} if kept.get(name) != found.get(name))
    for name in differing:
        print(f"differs: {name}")
    print(f"{len(found)} fingerprints, {len(differing)} differ")
    sys.exit(1 if differing else 0)


def fingerprints(folder: Path, only: str = "") -> dict[str, str]:
    """A digest by name; work that none of the ``only`` names needs is not done."""
    works: dict[str, Callable[[Path], Iterator[tuple[str, Any]]]] = {
        "openapi": _openapi, "help": _helps, "scene": _scene, "pvs": _pvs, "service": _service,
        "build": _build, "refusals": _refusals, "tradeoff": _tradeoff,
    }  # fmt: skip
    for number, (asset, options, suffix) in enumerate(CASES):
        if (ASSETS / asset).exists():
            works[f"simplify/{asset} {options} {suffix}"] = _simplifying(
                number, asset, options, suffix
            )
    chosen = {name: work for name, work in works.items() if only in name}
    found: dict[str, str] = {}
    with ThreadPoolExecutor(2) as pool:
        all_made = pool.map(lambda one: _made(*one, folder), chosen.items())
        for name, made in zip(chosen, all_made, strict=True):
            found |= made
            print(f"{name}: {len(made)}", file=sys.stderr)
    return found


def _made(
    name: str, work: Callable[[Path], Iterator[tuple[str, Any]]], folder: Path
) -> dict[str, str]:
    place = folder / hashlib.sha256(name.encode()).hexdigest()[:12]
    place.mkdir()
    return {f"{name}: {part}": _digest(value) for part, value in work(place)}


def _digest(value: Any) -> str:
    if not isinstance(value, bytes):
        text = value if isinstance(value, str) else json.dumps(value, sort_keys=True)
        value = text.encode(errors="surrogateescape")
    return hashlib.sha256(value).hexdigest()[:20]


def _simplifying(
    number: int, asset: str, options: str, suffix: str
) -> Callable[[Path], Iterator[tuple[str, Any]]]:
    def work(folder: Path) -> Iterator[tuple[str, Any]]:
        output = folder / f"occluder{suffix}"
        ran = _run(
            folder, "simplify", str(ASSETS / asset), "-o", str(output), *options.split(),
            "--report", str(folder / "report.json"), "--pictures", str(folder / "pictures"),
            "--views", "64", "--seed", "3" if "--seed" not in options else options.split()[-1],
        )  # fmt: skip
        yield from _told(ran)
        yield from _files(folder)
        if suffix in (".glb", ".obj") and "--lods" not in options and number % 2 == 0:
            judged = _run(
                folder, "evaluate", str(ASSETS / asset), str(output), "--views", "32",
                "--report", str(folder / "judged.json"),
            )  # fmt: skip
            yield from (("evaluate " + name, value) for name, value in _told(judged))
            report = _without_place((folder / "judged.json").read_text(), folder)
            yield "evaluate report", _plain(json.loads(report))

    return work


def _openapi(folder: Path) -> Iterator[tuple[str, Any]]:
    made = subprocess.run(
        [sys.executable, "-m", "service.openapi"], cwd=ROOT, capture_output=True, check=True
    )
    yield "printed", made.stdout.decode()
    yield "file", (ROOT / "openapi.yaml").read_bytes()


def _helps(folder: Path) -> Iterator[tuple[str, Any]]:
    yield "occluder", _run(folder, "--help").out
    for name in (
        "simplify", "evaluate", "tradeoff", "path", "scene", "cull", "pvs", "pvs-show", "pvs-check",
        "build", "watch", "warmup",
        "serve", "submit", "keys", "keys create", "keys list", "keys revoke", "keys secret",
        "keys rotate", "keys journal",
    ):  # fmt: skip
        yield name, _run(folder, *name.split(), "--help").out


def _scene(folder: Path) -> Iterator[tuple[str, Any]]:
    asset = str(ASSETS / "building_duplex.glb")
    made = str(folder / "made")
    yield from _told(_run(folder, "scene", asset, "-o", made, "--up", "z", "--preview"))
    path = str(folder / "walk.json")
    walked = _run(folder, "path", asset, "-o", path, "--up", "z", "--kind", "inside",
                  "--frames", "12")  # fmt: skip
    yield from (("path " + name, value) for name, value in _told(walked))
    culled = _run(folder, "cull", asset, "--occluders", made, "--path", path,
                  "-o", str(folder / "culled"), "--image", "160x90")  # fmt: skip
    yield "cull status", culled.status
    for name, value in _files(folder):
        if "cull.csv" not in name and "cull.png" not in name:
            yield name, value


def _pvs(folder: Path) -> Iterator[tuple[str, Any]]:
    """Sets of a building and of a terrain: the files by their bytes, and what is told of them."""
    terrain = str(ASSETS / "dem_jacksboro_344x403_int16.npy")
    posts = ("--spacing", "74.40,92.67", "--tile", "64")
    for name, scene, options, read in (
        ("building", str(ASSETS / "building_duplex.glb"),
         ("--up", "z", "--ground", "--cell-size", "2"), ()),
        ("terrain", terrain, (*posts, "--cell-size", "4000", "--cells", "grid"), posts),
    ):  # fmt: skip
        sets = str(folder / f"{name}.pvs")
        report = str(folder / f"{name}.json")
        runs = {
            "pvs": ("pvs", scene, "-o", sets, *options, "--report", report),
            "pvs-show": ("pvs-show", sets),
            "pvs-check": ("pvs-check", scene, sets, *read, "--cells", "4", "--views", "12"),
        }
        for command, arguments in runs.items():
            told = _told(_run(folder, *arguments))
            yield from ((f"{name} {command} {part}", value) for part, value in told)
    yield from _files(folder)


def _build(folder: Path) -> Iterator[tuple[str, Any]]:
    (folder / "bunny.ply").write_bytes((ASSETS / "bunny_4968.ply").read_bytes())
    (folder / "occluders.toml").write_text(
        '[defaults]\npreset = "draft"\nviews = 32\nground = true\n'
        "require = { min_recall = 0.5 }\n\n"
        '[[asset]]\nfiles = "*.ply"\noutput = ["{name}_occluder.glb", "{name}_occluder.obj"]\n'
    )
    for name in ("first", "second"):
        ran = _run(folder, "build", "--junit", "junit.xml", "--json", "build.json",
                   "--markdown", "build.md")  # fmt: skip
        yield from ((f"{name} {part}", value) for part, value in _told(ran))
    yield from (("check " + part, value) for part, value in _told(_run(folder, "build", "--check")))
    for name in ("bunny_occluder.glb", "bunny_occluder.obj"):
        yield name, (folder / name).read_bytes()
    yield "lock", _steady((folder / "occluders.lock").read_text())


def _tradeoff(folder: Path) -> Iterator[tuple[str, Any]]:
    ran = _run(
        folder, "tradeoff", str(ASSETS / "bunny_4968.ply"), "-o", str(folder / "out"), "--ground",
        "--resolutions", "16,32", "--directions", "16", "--budgets", "16", "--times", "0.2",
        "--repeats", "1",
    )  # fmt: skip
    yield "status", ran.status
    yield "files", sorted(path.name for path in (folder / "out").iterdir())
    with (folder / "out" / "tradeoff.csv").open() as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    yield "columns", rows[0]


def _refusals(folder: Path) -> Iterator[tuple[str, Any]]:
    mesh = str(ASSETS / "bunny_4968.ply")
    for words in (
        f"simplify {mesh} -o out.xyz", f"simplify {mesh} -o o.glb --budget 0",
        f"simplify {mesh} -o o.glb --resolution 8 --error-bound 1",
        f"simplify {mesh} -o o.glb --moves 3 --time-limit 1",
        f"simplify {mesh} -o o.glb --error-bounds 1,1", f"simplify {mesh} -o o.glb --fov 3",
        f"simplify {mesh} -o o.glb --lods 2 --conservative",
        f"simplify {mesh} -o o.glb --smallest-hole 99", f"simplify {mesh} -o o.glb --shrink 9",
        f"simplify {mesh} -o o.glb --error-bound 1e-9", f"simplify {mesh} -o {mesh}",
        f"simplify {mesh} -o o.glb --memory-limit 0.001", f"simplify {mesh} -o o.glb --up w",
        f"evaluate {mesh} nowhere.glb", f"scene {mesh} -o s --width 1",
        f"scene {mesh} -o s --pixel-error 0", f"tradeoff {mesh} -o t --times 0",
        f"tradeoff {mesh} -o t --resolutions a,b", f"path {mesh} -o p.json --eye-height 0",
        f"cull {mesh} --occluders none --path none -o c --image 3", "build",
        f"pvs {mesh} -o s.pvs --cell-size 0", f"pvs {mesh} -o s.pvs --spacing 1,1",
        f"pvs {mesh} -o s.pvs --memory-limit 0.001", "pvs nowhere.npy -o s.pvs --spacing 1,1",
        "pvs nowhere.npy -o s.pvs", "pvs-show nowhere.pvs", f"pvs-check {mesh} nowhere.pvs",
        "simplify nowhere.ply -o o.glb",
    ):  # fmt: skip
        ran = _run(folder, *words.split())
        printed = [_steady(text.replace(mesh, "MESH")) for text in (ran.out, ran.errors)]
        yield words.replace(mesh, "MESH"), [ran.status, *printed]


def _service(folder: Path) -> Iterator[tuple[str, Any]]:
    """A server's answers: the plain pages, a job by form, its result, files and refusals."""
    with (folder / "log").open("w") as log:
        server = subprocess.Popen(
            [*COMMAND, "serve", "--port", "0", "--data", str(folder / "data")], cwd=folder,
            stdout=subprocess.PIPE, stderr=log, text=True, env=_environment(),
        )  # fmt: skip
    try:
        assert server.stdout is not None
        address = server.stdout.readline().split()[-1]
        yield from _answers(address)
    finally:
        server.send_signal(signal.SIGTERM)
        server.wait(30)


def _answers(address: str) -> Iterator[tuple[str, Any]]:
    for place in (
        "/openapi.json", "/problems/invalid-option", "/problems/queue-full", "/docs", "/healthz",
        "/v1/jobs", "/v1/assets", "/v1/jobs/nothing", "/nowhere",
    ):  # fmt: skip
        yield place, _asked(address, place)
    body = (ASSETS / "bunny_4968.ply").read_bytes()
    query = "filename=bunny.ply&ground=true&preset=draft&views=32&budget=40&seed=3"
    place = f"/v1/occluders?{query}&asset=bunny"
    sent = {"Prefer": "wait=120", "Content-Type": "application/octet-stream"}
    yield "job", _asked(address, place, body, sent)
    yield (
        "glb",
        _asked(address, place, body, {**sent, "Accept": "model/gltf-binary"}, whole=True)[1],
    )
    yield "obj", _asked(address, place, body, {**sent, "Accept": "model/obj"}, whole=True)[1]
    yield "ranged", _asked(address, "/v1/assets/bunny")
    for wrong in ("budget=0", "nothing=1", "moves=8&time_limit=1", "lods=2&conservative=true",
                  "up=w", "times=1", "error_bounds=1,x"):  # fmt: skip
        yield wrong, _asked(address, f"/v1/occluders?filename=a.ply&{wrong}", body, sent)
    time.sleep(0.2)
    jobs = json.loads(urlopen(address + "/v1/jobs", timeout=30).read())
    rows = next(value for value in jobs.values() if isinstance(value, list))
    number = rows[0]["id"]
    for part in ("", "/result", "/files/report.json", "/events"):
        yield f"job{part}", _asked(address, f"/v1/jobs/{number}{part}")
    for page in ("/", "/submit", "/jobs", f"/jobs/{number}", "/assets/bunny", "/tradeoff"):
        answer = _asked(address, page, None, {"Accept": "text/html"}, whole=True)
        yield f"page {page.replace(number, 'ID')}", _words(answer[1].decode(), number)


def _words(page: str, number: str) -> list[str]:
    """The texts of a page, without what a server draws at random."""
    texts = re.findall(r'"(?:text|label|content|placeholder|title|aria-label)":"([^"]*)"', page)
    return [_steady(text.replace(number, "ID")) for text in texts]


def _asked(
    address: str, place: str, body: bytes | None = None, headers: Mapping[str, str] | None = None,
    *, whole: bool = False,
) -> Any:  # fmt: skip
    request = Request(address + place, body, dict(headers or {}))
    try:
        with urlopen(request, timeout=180) as answer:
            status, kind, data = answer.status, answer.headers["Content-Type"], answer.read()
    except OSError as error:
        if not hasattr(error, "read"):
            raise
        status, kind, data = error.code, error.headers["Content-Type"], error.read()  # type: ignore[attr-defined]
    if whole:
        return status, data
    text = data.decode(errors="replace").replace(address, "HOST")
    if "json" in kind:
        return [status, kind, _plain(json.loads(text))]
    if kind.startswith("text/event-stream"):
        return [status, kind, [_event(line) for line in text.splitlines()]]
    return [status, kind, _steady(text)]


def _event(line: str) -> Any:
    name, _, data = line.partition(": ")
    return [name, _plain(json.loads(data)) if name == "data" else data]


def _run(folder: Path, *arguments: str) -> Ran:
    ran = subprocess.run(
        [*COMMAND, *arguments], cwd=folder, env=_environment(), capture_output=True, text=True,
        errors="surrogateescape", timeout=600, check=False,
    )  # fmt: skip
    return Ran(ran.returncode, ran.stdout, ran.stderr, folder)


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", "TERM": "dumb",
            "NO_COLOR": "1"}  # fmt: skip


def _told(ran: Ran) -> Iterator[tuple[str, Any]]:
    yield "status", ran.status
    yield "printed", _steady(_without_place(ran.out, ran.folder))
    # How far a run is at some second is a time as well.
    said = [line for line in ran.errors.splitlines(True) if not line.startswith("progress: ")]
    yield "errors", _steady(_without_place("".join(said), ran.folder))


def _files(folder: Path) -> Iterator[tuple[str, Any]]:
    """All files below the folder: pictures and meshes by their bytes, texts less their times."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if not path.is_file() or name.startswith(("log", "data/")):
            continue
        if path.suffix == ".json":
            yield name, _plain(json.loads(_without_place(path.read_text(), folder)))
        elif path.suffix in (".html", ".csv", ".md", ".xml"):
            yield name, _steady(_without_place(path.read_text(), folder))
        else:
            yield name, path.read_bytes()


def _plain(value: Any) -> Any:
    """JSON without times and without names that are drawn at random."""
    if isinstance(value, dict):
        if value.get("name") in ("report.html", "report.json"):
            return value["name"]  # its digest and its size are those of times
        return {key: _plain(one) for key, one in value.items() if key not in _TIMES}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return _steady(value) if isinstance(value, str) else value


def _steady(text: str) -> str:
    for pattern, word in _VOLATILE:
        text = pattern.sub(word, text)
    return re.sub(r" +", " ", text)


def _without_place(text: str, folder: Path) -> str:
    return text.replace(str(folder), "FOLDER").replace(folder.name, "FOLDER")


def _write(path: Path, found: Mapping[str, str]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("what", "sha256"))
        writer.writerows(sorted(found.items()))


def _read(path: Path) -> dict[str, str]:
    with path.open(newline="") as file:
        return dict(list(csv.reader(file))[1:])


if __name__ == "__main__":
    main()
