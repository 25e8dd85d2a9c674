"""One asset made: its files in a folder to be moved from, and what the record says of them.

Makers on other machines, by the address that they are asked at.

A package above this one adds them by an entry point of the group :data:`MAKER_GROUP`, whose name is
the scheme of an address and whose object is called with the address, an API key or None, and an
event that ends the work once it is set; it returns a context manager of a
:data:`~simplifier.builds.making.Maker` that is safe to call from several threads.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from simplifier.builds.digests import Digests
from simplifier.builds.finding import AssetFigures
from simplifier.builds.outputs import Output
from simplifier.errors import MeshError, OccluderError, OptionError, OutputError
from simplifier.io.files import make_folder, read_bytes, write_all_whole
from simplifier.io.places import is_folder
from simplifier.io.suffixes import overrides_beside
from simplifier.options.simplify import SimplifyOptions
from simplifier.progress import Stopwatch
from simplifier.wording import verdict_words

if TYPE_CHECKING:
    from simplifier.production.result import MeasuredResult


@dataclass(frozen=True)
class Target:
    """``draft`` is written as ``output`` says, in a folder of its own; later it is moved to
    ``place``."""

    draft: Path
    place: Path
    output: Output


@dataclass(frozen=True)
class AssetJob:
    """A mesh and the files to make of it.

    ``overrides``  whether those of the file beside it count, where there is one.
    """

    mesh: Path
    options: SimplifyOptions
    targets: tuple[Target, ...]
    overrides: bool = True


Maker = Callable[[AssetJob], Mapping[str, Any]]
"""Writes the drafts of a job and returns the report, as ``docs/report.schema.json`` says; levels of
detail go to files as ``SimplifyResult.save`` names them.

Raises :class:`~simplifier.errors.OccluderError`.
"""


@dataclass(frozen=True)
class MadeAsset:
    """``mesh`` and ``beside`` as in :class:`~simplifier.builds.record.Entry`; a verdict that is not
    good is the first of the ``warnings``.  ``report`` is the maker's."""

    mesh: str
    beside: Mapping[str, str]
    version: str
    figures: AssetFigures
    warnings: tuple[str, ...]
    seconds: float
    report: Mapping[str, Any]


def make_asset(
    maker: Maker, job: AssetJob, *, reading: AbstractContextManager[object] | None = None
) -> MadeAsset:
    """``reading``  what is held while the mesh is in memory to be hashed.

    Raises :class:`~simplifier.errors.MeshError` where the mesh changes meanwhile, and else what
    the maker raises; what cannot be written costs this asset alone, too."""
    begin, reading = time.perf_counter(), reading or nullcontext()
    with reading:
        before = mesh_stamp(job.mesh)
    for target in job.targets:
        target.draft.parent.mkdir(parents=True, exist_ok=True)  # of an attempt that ended
    try:
        report = maker(job)
    except OutputError as error:
        raise OccluderError(error.what, where=error.where, remedy=error.remedy) from None
    with reading:
        after = mesh_stamp(job.mesh)
    if after != before:
        raise MeshError("it changed while it was read", where=str(job.mesh), remedy="build again")
    mesh, beside = before
    verdict = report["verdict"]
    not_good = () if verdict["word"] == "good" else (verdict_words(verdict),)
    return MadeAsset(
        mesh, beside, str(report["version"]), AssetFigures.of(report),
        (*not_good, *report["warnings"]), time.perf_counter() - begin, report,
    )  # fmt: skip


def make_here(job: AssetJob) -> Mapping[str, Any]:
    """The maker of this machine."""
    # Here, not above: a build on a server need not load what makes occluders.
    from simplifier.api import simplify
    from simplifier.geometry.overrides import NO_OVERRIDES
    from simplifier.io.load import load
    from simplifier.io.overrides import overrides_of

    options = job.options
    by_hand = overrides_of(job.mesh) if job.overrides else NO_OVERRIDES
    watch = Stopwatch()
    with watch.stage("load"):
        soup = load(
            job.mesh,
            transparent=options.transparent,
            ignore=by_hand.ignore,
            memory_limit=options.memory_limit,
        )
    product = simplify(soup, options, overrides=by_hand).measure()
    with watch.stage("write"):
        written = [_write(product, job.mesh, target) for target in job.targets]
    return product.report(
        load_seconds=watch.timings["load"], write_seconds=watch.timings["write"],
        files=written[0], names=(str(job.mesh), str(job.targets[0].place)),
    )  # fmt: skip


def _write(product: MeasuredResult, mesh: Path, target: Target) -> tuple[Path, ...]:
    """The files, the finest level's first."""
    from simplifier.io.glb_embed import with_original
    from simplifier.options.simplify import Style

    output = target.output
    style = Style(output.sides, output.as_quads)
    if output.with_original is None:
        return product.save(target.draft, style)
    made = (product.mesh, product.occluder, target.place, output.with_original, style)
    target.draft.write_bytes(with_original(mesh, *made))
    return (target.draft,)


def put_in_place(job: AssetJob) -> dict[Path, bytes]:
    """Move the drafts of a job that is done to where they belong, all or none; the files.

    Raises :class:`~simplifier.errors.OutputError`.
    """
    files = {
        target.place.with_name(file.name): file.read_bytes()
        for target in job.targets
        for file in sorted(target.draft.parent.iterdir())
    }
    for target in job.targets:
        make_folder(target.place.parent)
    write_all_whole(files)
    return files


def mesh_stamp(mesh: Path) -> tuple[str, dict[str, str]]:
    """The digests of a mesh and of the files that it is read with, its overrides among them."""
    # Here, not above: a build in which nothing is stale need not load the codecs.
    from simplifier.io.formats import codec_for_reading

    digests = Digests()
    codec, data = codec_for_reading(mesh), read_bytes(mesh)
    names = [unquote(uri) for uri in codec.external(data, mesh)] if codec.external else []
    names += codec.consulted(data, mesh) if codec.consulted else []
    by_hand = overrides_beside(mesh)
    names += [] if by_hand is None else [by_hand.name]
    beside = {name: digests.of(mesh.parent / name) or "" for name in sorted(set(names))}
    return digests.of(mesh) or "", beside


def scene_stamp(source: Path) -> tuple[str, dict[str, str]]:
    """The same of what a scene is read from, which may be a folder: then the digest is empty, and
    all files are told by their paths in it."""
    if not is_folder(source):
        return mesh_stamp(source)
    from simplifier.io.scene import files_of

    found: dict[str, str] = {}
    for mesh in files_of(source):
        place = mesh.relative_to(source)
        try:
            digest, beside = mesh_stamp(mesh)
        except OccluderError:  # a damaged one is left out of the scene
            digest, beside = Digests().of(mesh) or "", {}
        found |= {(place.parent / name).as_posix(): of_it for name, of_it in beside.items()}
        found[place.as_posix()] = digest
    return "", found


__all__ = ["MAKER_GROUP", "AssetJob", "Maker", "maker_at"]

MAKER_GROUP = "occluder.makers"


def maker_at(address: str, key: str | None, stop: threading.Event) -> AbstractContextManager[Maker]:
    """Raises :class:`OptionError` for an address that nobody is asked at."""
    from importlib.metadata import entry_points  # which takes a while to load

    scheme = address.partition("://")[0].lower() if "://" in address else ""
    known = {one.name: one for one in entry_points(group=MAKER_GROUP)}
    if scheme not in known:
        raise OptionError(
            f"'{address}' is not an address of a service",
            where="server",
            remedy="write as in http://127.0.0.1:8000"
            if known
            else "run: pip install 'planar-occluder[service]'",
        )
    found: AbstractContextManager[Maker] = known[scheme].load()(address, key, stop)
    return found
