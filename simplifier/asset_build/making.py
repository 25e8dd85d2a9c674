"""One asset made: its files in a folder to be moved from, and what the record says of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from simplifier.asset_build.digests import Digests
from simplifier.asset_build.figures import Figures
from simplifier.errors import MeshError, OccluderError, OutputError
from simplifier.io.source import read_bytes
from simplifier.production.options import SimplifyOptions

Maker = Callable[[Path, SimplifyOptions, Sequence[Path]], Mapping[str, Any]]
"""Makes an occluder of a mesh, writes it to each of some files, and returns its report, as
``docs/report.schema.json`` says; levels of detail go to files as ``Product.save`` names them.

Raises :class:`~simplifier.errors.OccluderError`.
"""


@dataclass(frozen=True)
class Job:
    """``targets``: files to write, each in a folder of its own that is not there yet."""

    mesh: Path
    options: SimplifyOptions
    targets: tuple[Path, ...]


@dataclass(frozen=True)
class Made:
    """``mesh`` and ``beside`` as in :class:`~simplifier.asset_build.record.Entry`."""

    mesh: str
    beside: Mapping[str, str]
    version: str
    figures: Figures
    warnings: tuple[str, ...]
    seconds: float


def make(maker: Maker, job: Job) -> Made:
    """Raises :class:`~simplifier.errors.MeshError` where the mesh changes meanwhile, and else what
    the maker raises; what cannot be written costs this asset alone, too."""
    begin = time.perf_counter()
    before = _stamp(job.mesh)
    for target in job.targets:
        target.parent.mkdir(parents=True)
    try:
        report = maker(job.mesh, job.options, job.targets)
    except OutputError as error:
        raise OccluderError(error.what, where=error.where, remedy=error.remedy) from None
    if _stamp(job.mesh) != before:
        raise MeshError(
            "the file changed while it was read", where=str(job.mesh), remedy="build again"
        )
    mesh, beside = before
    return Made(
        mesh, beside, str(report["version"]), Figures.of(report), tuple(report["warnings"]),
        time.perf_counter() - begin,
    )  # fmt: skip


def make_here(mesh: Path, options: SimplifyOptions, targets: Sequence[Path]) -> Mapping[str, Any]:
    """The maker of this machine."""
    # Here, not above: a build on a server need not load what makes occluders.
    from simplifier.io import load_mesh
    from simplifier.production.produce import produce

    soup = load_mesh(mesh, transparent=options.transparent, memory_limit=options.memory_limit)
    product = produce(soup, options)
    for target in targets:
        product.save(target)
    return product.report()


def _stamp(mesh: Path) -> tuple[str, dict[str, str]]:
    """The digests of a mesh and of the files that it is read with."""
    # Here, not above: a build in which nothing is stale need not load the codecs.
    from simplifier.io.formats import codec_for_reading

    digests = Digests()
    codec, data = codec_for_reading(mesh), read_bytes(mesh)
    names = [unquote(uri) for uri in codec.external(data, mesh)] if codec.external else []
    names += codec.consulted(data, mesh) if codec.consulted else []
    beside = {name: digests.of(mesh.parent / name) or "" for name in sorted(set(names))}
    return digests.of(mesh) or "", beside
