"""Meshes of one call to occluders: a file for each, without a manifest or a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from simplifier.builds.asset_plan import Asset, check_outputs
from simplifier.builds.finding import Requirements
from simplifier.builds.making import AssetJob, Target
from simplifier.builds.outputs import Output, fill_fields, is_template
from simplifier.errors import ManifestError, OptionError
from simplifier.io.places import followed
from simplifier.options.simplify import SimplifyOptions, WriteOptions


def places_of(meshes: Sequence[Path], output: Path, options: SimplifyOptions) -> dict[Path, Path]:
    """Where the occluder of each mesh goes; one that is named twice counts once.

    ``output``  a folder, for ``NAME_occluder.glb`` of each, or a template as in a manifest.

    Raises :class:`OptionError` where two meshes would become one file, or one would be replaced.
    """
    places = {mesh: _place(mesh, output) for mesh in meshes}
    assets = [
        Asset(
            followed(mesh).as_posix(), (Output(followed(place).as_posix()),), options,
            Requirements(), _WHERE,
        )
        for mesh, place in places.items()
    ]  # fmt: skip
    try:
        check_outputs(assets)
    except ManifestError as error:
        raise OptionError(error.what, where=_WHERE, remedy=error.remedy) from None
    return places


def batch_jobs(
    places: Mapping[Path, Path],
    options: SimplifyOptions,
    writing: WriteOptions,
    scratch: Path,
    *,
    overrides: bool,
) -> list[AssetJob]:
    """A job a mesh, with its drafts in a folder of its own below ``scratch``.

    ``overrides``  whether those beside the meshes count.
    """
    return [
        AssetJob(
            mesh,
            options,
            (Target(scratch / str(number) / place.name, place, _written(place, writing)),),
            overrides,
        )
        for number, (mesh, place) in enumerate(places.items())
    ]


_WHERE = "output"


def _place(mesh: Path, output: Path) -> Path:
    if is_template(output):
        try:
            return Path(fill_fields(output.as_posix(), mesh.as_posix(), _WHERE))
        except ManifestError as error:
            raise OptionError(error.what, where=_WHERE, remedy=error.remedy) from None
    return output / f"{mesh.stem}_occluder.glb"


def _written(place: Path, writing: WriteOptions) -> Output:
    return Output(str(place), writing.sides, writing.as_quads, writing.with_original)
