"""The commands on scenes of many objects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simplifier.cli_failures import guarded
from simplifier.console import print_line, print_text
from simplifier.culling.paths import generate_path
from simplifier.errors import OutputError
from simplifier.interrupts import interrupts
from simplifier.io.camera_path import save_camera_path
from simplifier.io.scene import load_scene
from simplifier.io.whole import check_folder
from simplifier.options import Axis, PathKind, PathOptions

Scene = Annotated[
    Path, typer.Argument(help="The scene: a mesh file, objects by its nodes, or a folder of them.")
]


def path(
    scene: Scene,
    output: Annotated[Path, typer.Option("-o", "--output", help="The camera path: a JSON file.")],
    kind: Annotated[
        PathKind,
        typer.Option(
            help="street: between the objects; roof: above them; inside: through rooms and doors."
        ),
    ] = "street",
    frames: Annotated[int, typer.Option(help="Cameras along the path.")] = 60,
    up: Annotated[Axis, typer.Option(help="The scene's up axis: x, y or z.")] = "y",
    eye_height: Annotated[
        float,
        typer.Option(
            help="Of the eyes over the ground, in the scene's units; all other lengths of the path "
            "are multiples of it. 1.7 where they are metres."
        ),
    ] = 1.7,
    fov: Annotated[float, typer.Option(help="Vertical field of view, degrees.")] = 60.0,
    seed: Annotated[int, typer.Option(help="Another one gives another path.")] = 0,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of a failure.")
    ] = False,
) -> None:
    """Write cameras along a walk or a flight through a scene, to judge occluders along."""

    def run() -> None:
        PathOptions(kind, frames, up, seed, eye_height, fov)  # refused before the scene is read
        _check_output(scene, output)
        with interrupts() as listening:
            read = load_scene(scene)
            found = generate_path(read, kind, frames, up, seed, eye_height, fov)
            with listening.held():
                save_camera_path(found, output)
                for warning in read.warnings:
                    print_line(f"warning: {warning}")
                print_text(f"{output}: {len(found.cameras)} frames of kind {kind}")

    guarded(run, debug=debug)


def _check_output(scene: Path, output: Path) -> None:
    check_folder(output)
    if scene.resolve() == output.resolve():
        raise OutputError(
            "this is the scene itself", where=str(output), remedy="name another file for the path"
        )
