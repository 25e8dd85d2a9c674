"""The command that judges the occluders of a scene along a camera path."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from simplifier.cli.console import print_line, print_rows, print_text, run_bar
from simplifier.cli.options import TransparentScene
from simplifier.cli.running import Debug, Interrupts, interrupts, run_guarded
from simplifier.culling.cull_options import CullOptions
from simplifier.culling.flythrough import Flythrough, fly
from simplifier.culling.flythrough_report import flythrough_files
from simplifier.culling.flythrough_rows import COUNTED, summary_rows
from simplifier.errors import OptionError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.manifest import load_occluder_tree
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.io.camera_path import load_camera_path
from simplifier.io.files import make_folder, write_whole
from simplifier.io.scene import load_scene


def cull(
    scene: Annotated[
        Path, typer.Argument(help="The scene that the occluders were made for: a file or a folder.")
    ],
    occluders: Annotated[
        Path, typer.Option(help="Folder that 'occluder scene' wrote for this scene.")
    ],
    path: Annotated[Path, typer.Option(help="Camera path: 'occluder path' writes one.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="Folder for cull.csv, .json, .png and frames.png."),
    ],
    image: Annotated[
        str, typer.Option(metavar="WxH", help="Depth buffer, pixels across and down.")
    ] = "320x180",
    pixel_error: Annotated[
        float | None,
        typer.Option(
            help="Largest error of the occluders that are drawn, in pixels; more draws fewer "
            "triangles and hides less.",
            show_default="as they were built for",
        ),
    ] = None,
    transparent: TransparentScene = "leave-out",
    debug: Debug = False,
) -> None:
    """Judge the occluders of a scene along a camera path: what they hide, against the truth.

    Ctrl-C ends it and keeps what was measured so far.
    """

    def run() -> None:
        columns, rows = _screen(image)
        options = CullOptions(rows, columns, pixel_error)
        with interrupts() as listening:
            cameras, tree = load_camera_path(path), load_occluder_tree(occluders)
            read = load_scene(scene, transparent=transparent)  # last, for it takes longest
            make_folder(output)
            flown = _fly(read, tree, cameras, options, listening)
            with listening.deferred():  # what was measured is not to be lost to a late Ctrl-C
                for name, data in flythrough_files(flown, scene.resolve().name):
                    with listening.held():
                        write_whole(output / name, data)
                print_rows(
                    f"{scene.resolve().name}, {path.name}", summary_rows(flown), read.warnings
                )
                print_text(COUNTED)
        if not flown.complete:
            frames = f"{len(flown.frames)} of {len(cameras.cameras)} frames"
            print_line(f"warning: interrupted after {frames}; {output} holds what they gave")

    run_guarded(run, debug=debug)


def _fly(
    read: Scene, tree: OccluderTree, path: CameraPath, options: CullOptions, listening: Interrupts
) -> Flythrough:
    with listening.deferred() as cancel, run_bar(len(path.cameras)) as tell:
        return fly(read, tree, path, options, tell, cancel)


def _screen(text: str) -> tuple[int, int]:
    """``"320x180"`` as columns and rows; raises :class:`OptionError` for anything else."""
    found = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text.strip(), flags=re.ASCII)
    if found is None:
        raise OptionError(
            f"'{text}' is no size", where="image", remedy="give columns and rows, as in 320x180"
        )
    return int(found[1]), int(found[2])
