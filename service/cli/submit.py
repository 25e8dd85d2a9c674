"""The command that has occluders made by a service."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.command import run_command
from service.keep import Keep
from service.schemas.job_options import LEVELS
from simplifier import OCCLUDER_SUFFIXES, OptionError, SimplifyOptions
from simplifier.cli.plugin import (
    Debug,
    make_folder,
    overrides_beside,
    read_values,
    with_options,
)

_OF_SERVER = {"slicer", "device"}
_FIELDS = tuple(
    replace(one, absent=str(LEVELS)) if one.name == "lods" else one
    for one in SimplifyOptions.fields()
    if one.name not in _OF_SERVER
)
_DEFAULTS = {field.name: field.default for field in _FIELDS}


@with_options(_FIELDS)
def submit(
    meshes: Annotated[
        list[Path], typer.Argument(metavar="MESH...", help="Meshes: glb, gltf, obj, ply, stl...")
    ],
    server: Annotated[
        str, typer.Option(envvar="OCCLUDER_SERVER", help="Address of the service.")
    ] = "http://127.0.0.1:8000",
    key: Annotated[
        str | None, typer.Option(envvar="OCCLUDER_KEY", help="API key, where one is needed.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the occluders.", show_default="beside"),
    ] = None,
    *,
    form: Annotated[
        str,
        typer.Option("--format", help="Of the occluders: glb, occ, obj, ply, stl, off or tres."),
    ] = "glb",
    asset: Annotated[
        str | None,
        typer.Option(help="Name whose run each becomes; {name} in it is that of the mesh."),
    ] = None,
    keep: Annotated[
        Keep | None,
        typer.Option(
            help="What the service stores of each result: all files, or the occluder and its "
            "report, and makes the others when they are asked for.",
            show_default="the service's",
        ),
    ] = None,
    no_overrides: Annotated[
        bool, typer.Option("--no-overrides", help="Do not send the files of overrides.")
    ] = False,
    at_once: Annotated[int, typer.Option(min=1, max=64, help="Meshes under way.")] = 8,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Have occluders made by a service: send meshes, wait, fetch NAME_occluder beside each.

    A mesh goes with the NAME.overrides.toml beside it, if that is there.  A glb holds all levels of
    detail; other formats have a file a level, NAME_occluder_lod0 and so on.  Exit status 1 when any
    failed.  Ctrl-C cancels the jobs that were begun here.
    """

    def run() -> int:
        # Here, not above: 'occluder submit --help' need not have a client installed.
        from service.cli.batch import submit_all
        from service.cli.mesh_submission import MeshSubmission

        options = _options_to_send(read_values(_FIELDS, chosen))
        targets = _targets(meshes, output, form)
        names = _asset_names(meshes, asset)
        submissions = [
            MeshSubmission(
                mesh, target, options, name, None if no_overrides else overrides_beside(mesh)
            )
            for mesh, target, name in zip(meshes, targets, names, strict=True)
        ]
        if output is not None:
            make_folder(output)
        return submit_all(submissions, server, key, at_once, keep)

    run_command(run, debug=debug)


def _options_to_send(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """What differs from the defaults, which the server knows, each checked before any upload."""
    for field in _FIELDS:
        field.check(chosen[field.name])
    return {name: value for name, value in chosen.items() if value != _DEFAULTS[name]}


def _targets(meshes: Sequence[Path], folder: Path | None, form: str) -> list[Path]:
    """The file that each occluder goes to; no two are the same, and none is a mesh."""
    suffix = f".{form}"
    if suffix not in OCCLUDER_SUFFIXES:
        known = ", ".join(one[1:] for one in OCCLUDER_SUFFIXES)
        raise OptionError(
            f"'{form}' is not a format", where="format", remedy=f"choose from {known}"
        )
    targets = [
        (mesh.parent if folder is None else folder) / f"{mesh.stem}_occluder{suffix}"
        for mesh in meshes
    ]
    for target, count in Counter(target.resolve() for target in targets).items():
        if count > 1:
            raise OptionError(
                f"{count} occluders would be written to it",
                where=str(target),
                remedy="submit meshes of the same name one by one, to different folders",
            )
    return targets


def _asset_names(meshes: Sequence[Path], asset: str | None) -> list[str | None]:
    if asset is not None and len(meshes) > 1 and "{name}" not in asset:
        raise OptionError(
            f"'{asset}' would be the name of {len(meshes)} meshes",
            where="asset",
            remedy="put {name} into it, as in 'props/{name}'",
        )
    return [None if asset is None else asset.replace("{name}", mesh.stem) for mesh in meshes]
