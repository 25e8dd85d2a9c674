"""Every error of the library and every problem of the service, raised, and as tables for the docs.

``python -m tests.extremes.refusals`` prints what ``docs/errors.md`` holds.
"""

from __future__ import annotations

import inspect
import re
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr
from importlib.metadata import EntryPoint
from io import StringIO
from pathlib import Path

import httpx
import typer

import simplifier
from service.errors import ServiceError
from service.routes.explanations import ADVICE, kinds
from simplifier import errors
from simplifier.builds.manifest import read_manifest
from simplifier.cli.main import _from_outside
from simplifier.cli.running import run_guarded
from simplifier.errors import OccluderError
from simplifier.io.toml import read_toml
from tests.service.routes.serving import OBJ, Served, served
from tests.solids import box

_IDS = re.compile(r"[0-9a-f]{32}")
QUICK = {"budget": 8, "resolution": 8, "preset": "draft", "moves": 0}


def library_errors() -> list[type[OccluderError]]:
    """In the order of ``simplifier/errors.py``."""
    found = [one for _, one in inspect.getmembers(errors, inspect.isclass)]
    return sorted(
        (one for one in found if issubclass(one, OccluderError)),
        key=lambda one: inspect.getsourcelines(one)[1],
    )


# --- What raises each; ``folder`` is empty


def _file(name: str, data: bytes, read: Callable[[Path], object]) -> Callable[[Path], object]:
    """A file that is read."""

    def written_and_read(folder: Path) -> object:
        path = folder / name
        path.write_bytes(data)
        return read(path)

    return written_and_read


def _arrays(folder: Path) -> object:
    return simplifier.TriangleMesh.from_soup([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])


def _unknown(folder: Path) -> object:
    return simplifier.load(folder / "castle.fbx")


def _unbuilt(folder: Path) -> object:
    return simplifier.load_occluder_tree(folder)


def _memory(folder: Path) -> object:
    return simplifier.simplify(box(), budget=80, resolution=1024, memory_limit=0.5).occluder


def _option(folder: Path) -> object:
    return simplifier.simplify(box(), budget=0).occluder


def _without_opengl(folder: Path) -> object:
    # Not patch.dict, which also takes away the modules that are imported meanwhile.
    known = sys.modules.get("moderngl")
    sys.modules["moderngl"] = None  # type: ignore[assignment]
    try:
        return simplifier.simplify(box(), slicer="gl", **QUICK).occluder
    finally:
        del sys.modules["moderngl"]
        if known is not None:
            sys.modules["moderngl"] = known


def _no_folder(folder: Path) -> None:
    simplifier.save(simplifier.Occluder(box().vertices, box().faces), folder / "out" / "box.glb")


def _foreign_command(folder: Path) -> None:
    _from_outside(EntryPoint("host", "nowhere:command", "occluder.commands"))


def _cancelled(folder: Path) -> object:
    cancel = threading.Event()
    cancel.set()
    return simplifier.simplify(box(), cancel=cancel).occluder


LIBRARY: dict[type[OccluderError], Callable[[Path], object]] = {
    errors.MeshError: _arrays,
    errors.UnreadableMeshError: _file(
        "tower.obj", b"v 0 0 0\nv 1,5 0 0\nv 0 1 0\nf 1 2 3\n", simplifier.load
    ),
    errors.UnknownFormatError: _unknown,
    errors.EmptyMeshError: _file(
        "flat.obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", simplifier.load
    ),
    errors.SceneError: _unbuilt,
    errors.UnreadablePathError: _file(
        "walk.json",
        b'{"schema_version": 1, "name": "walk", "frames": []}',
        simplifier.load_camera_path,
    ),
    errors.UnreadablePvsError: _file("city.pvs", b"glTF", simplifier.load_pvs),
    errors.TomlError: _file("occluders.toml", b'[[asset]]\nfiles = "*.glb\n', read_toml),
    errors.OverridesError: _file(
        "castle.overrides.toml",
        b"[[box]]\ncentre = [0, 0, 0]\nsize = [1, 2, 3]\n",
        simplifier.load_overrides,
    ),
    errors.ManifestError: _file(
        "occluders.toml",
        b'[defaults]\nbugdet = 64\n\n[[asset]]\nfiles = "*.glb"\n',
        read_manifest,
    ),
    errors.OptionError: _option,
    errors.MemoryLimitError: _memory,
    errors.BackendUnavailableError: _without_opengl,
    errors.OutputError: _no_folder,
    errors.CommandError: _foreign_command,
    errors.CancelledError: _cancelled,
}
"""All but the root of the tree, which is never raised itself."""


def raised(kind: type[OccluderError]) -> OccluderError:
    """The error of that kind which the example gives, files by their names alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            LIBRARY[kind](folder)
        except OccluderError as error:
            return type(error)(
                error.what.replace(f"{folder}/", ""),
                where=error.where.replace(f"{folder}/", "").replace(name, "FOLDER"),
                remedy=error.remedy,
            )
    raise AssertionError(f"the example of {kind.__name__} raises nothing")


def exit_status(error: OccluderError) -> int:
    """What a command ends with that raises it."""

    def work() -> None:
        raise error

    try:
        with redirect_stderr(StringIO()):
            run_guarded(work, debug=False)
    except typer.Exit as end:
        return end.exit_code
    raise AssertionError("a failure ended well")


def library_table() -> str:
    rows = ["| error | when | for example | exit status |", "|---|---|---|---:|"]
    for kind in library_errors():
        if kind in LIBRARY:
            error = raised(kind)
            rows.append(f"| `{kind.__name__}` | {_when(kind)} | {error} | {exit_status(error)} |")
    return "\n".join(rows)


# --- The service


SERVICE: dict[str, Callable[[Served], httpx.Response]] = {
    "bad-request": lambda one: one.http.put(
        "/v1/assets", content=b"{", headers={"Content-Type": "application/json"}
    ),
    "unreadable-mesh": lambda one: one.post(body=b""),
    "invalid-overrides": lambda one: one.http.post(
        "/v1/occluders",
        files={"mesh": ("castle.obj", OBJ), "overrides": ("castle.overrides.toml", b"")},
    ),
    "not-found": lambda one: one.http.get("/v1/jobs/0"),
    "method-not-allowed": lambda one: one.http.delete("/v1/jobs/0"),
    "not-acceptable": lambda one: one.post(headers={"Accept": "image/png"}),
    "conflict": lambda one: one.http.post(f"/v1/jobs/{one.done()}/cancel"),
    "too-large": lambda one: one.post(body=b"v 0 0 0\n" * 200_000),
    "unsupported-media-type": lambda one: one.post("/v1/occluders?filename=castle.fbx"),
    "range-not-satisfiable": lambda one: one.http.get(
        f"/v1/jobs/{one.done()}/files/report.json", headers={"Range": "bytes=999999-"}
    ),
    "invalid-options": lambda one: one.post("/v1/occluders?filename=castle.obj&budget=0"),
}
"""What a single request can bring about, by slug."""


@contextmanager
def a_service() -> Iterator[Served]:
    with (
        tempfile.TemporaryDirectory() as name,
        served(Path(name), max_wait=5.0, max_upload=1 << 20) as one,
    ):
        yield one


def service_table() -> str:
    rows = ["| problem | when | for example | what to do | status |", "|---|---|---|---|---:|"]
    with a_service() as service:
        for kind in sorted(kinds(), key=lambda one: (one.status, one.slug)):
            told = SERVICE[kind.slug](service).json() if kind.slug in SERVICE else None
            example = _IDS.sub("ID", f"{told['detail']}; {told['remedy']}") if told else ""
            rows.append(
                f"| `{kind.slug}` | {_when(kind)} | {example} | {ADVICE[kind.slug]} |"
                f" {kind.status} |"
            )
    return "\n".join(rows)


def _when(kind: type[OccluderError] | type[ServiceError]) -> str:
    """The first sentence of the class."""
    if kind is ServiceError:
        return "Something went wrong that should not have."
    return (inspect.getdoc(kind) or "").split("\n\n")[0].replace("\n", " ")


if __name__ == "__main__":
    print(library_table(), service_table(), sep="\n\n")
