"""The command that writes cameras through a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.cli.console import print_line, print_text
from simplifier.cli.help import OUTPUT, with_examples
from simplifier.cli.options import SceneArgument, read_options, with_options
from simplifier.cli.running import Debug, Quiet, interrupts, run_guarded
from simplifier.io.camera_path import save_camera_path
from simplifier.io.files import check_apart, check_folder
from simplifier.io.scene import load_scene
from simplifier.options.scene import PathOptions
from simplifier.wording import count


@with_examples(
    ("occluder path town.glb -o walk.json", "Walk between the buildings for 60 frames."),
    ("occluder path town.glb -o flight.json --kind roof --frames 200", "Fly above the roofs."),
    ("occluder path house.glb -o rooms.json --kind inside --up z", "Walk through the rooms."),
)
@with_options(PathOptions)
def path(
    scene: SceneArgument,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="The JSON file to write the path to.", rich_help_panel=OUTPUT
        ),
    ],
    *,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Write cameras along a walk or a flight through a scene, to judge occluders along."""

    def run() -> None:
        # Here, not above: what it needs of scipy takes longer to load than a small change to build.
        from simplifier.camera_paths.generate import generate_path

        options = read_options(PathOptions, chosen)  # refused before the scene is read
        check_output(scene, output, "the path")
        with interrupts() as listening:
            read = load_scene(scene, transparent=options.transparent)
            found = generate_path(read, options)
            with listening.held():
                save_camera_path(found, output)
                for warning in read.warnings:
                    print_line(f"warning: {warning}")
                print_text(f"{output}: {count(len(found.cameras), 'frame')} of kind {options.kind}")

    run_guarded(run, debug=debug, quiet=quiet)


def check_output(scene: Path, output: Path, what: str) -> None:
    """Raise :class:`OutputError` where ``what`` cannot be written, or would replace the scene."""
    check_folder(output)
    check_apart([output], what, [(scene, "the scene itself")])
