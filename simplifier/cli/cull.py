"""The command that judges the occluders of a scene along a camera path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.cli.console import (
    print_closing,
    print_json,
    print_line,
    print_rows,
    print_table,
    print_text,
    run_bar,
)
from simplifier.cli.help import INPUT, OUTPUT, with_examples
from simplifier.cli.options import read_options, with_options
from simplifier.cli.running import AsJson, Debug, Interrupts, Quiet, interrupts, run_guarded
from simplifier.culling.flythrough import Flythrough, fly
from simplifier.culling.flythrough_report import flythrough_files, summary
from simplifier.culling.flythrough_rows import (
    COUNTED,
    drawn_tables,
    pixel_words,
    summary_rows,
)
from simplifier.culling.visible_sets import VisibleSets
from simplifier.errors import OptionError
from simplifier.geometry.camera import CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.packed_file import PACKED_FILE
from simplifier.hierarchy.scene_file import SCENE_FILE, load_occluder_tree
from simplifier.io.camera_path import load_camera_path
from simplifier.io.files import make_folder, write_whole
from simplifier.io.places import followed, is_file
from simplifier.io.pvs_file import load_pvs
from simplifier.io.scene import load_scene
from simplifier.io.scene_layers import hiding_of, whole_scene
from simplifier.options.scene import CullOptions
from simplifier.wording import count, percent


@with_examples(
    (
        "occluder cull town.glb --occluders town --path walk.json -o culled",
        "Measure what the occluders in the folder town hide along a walk.",
    ),
    (
        "occluder cull town.glb --occluders town --path walk.json -o culled --pvs town.pvs",
        "Compare with visible sets that were found before.",
    ),
    (
        "occluder cull town.glb --occluders town --path walk.json -o culled --image 640x360",
        "Use a finer depth buffer.",
    ),
)
@with_options(CullOptions)
def cull(
    scene: Annotated[
        Path, typer.Argument(help="The scene that the occluders were made for: a file or a folder.")
    ],
    occluders: Annotated[
        Path,
        typer.Option(
            help="The folder that 'occluder scene' wrote for this scene, or a scene file of"
            " occluders that were made elsewhere.",
            rich_help_panel=INPUT,
        ),
    ],
    path: Annotated[
        Path,
        typer.Option(help="The camera path. 'occluder path' writes one.", rich_help_panel=INPUT),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Folder for cull.csv, cull.json, walk.html, cull.png and frames.png.",
            rich_help_panel=OUTPUT,
        ),
    ],
    *,
    pvs: Annotated[
        Path | None,
        typer.Option(
            help="Visible sets that 'occluder pvs' wrote, to compare with.", rich_help_panel=INPUT
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Judge the occluders of a scene along a camera path: what they hide, against the truth.

    Press Ctrl-C to stop and keep what was measured so far.
    """

    def run() -> None:
        options = read_options(CullOptions, chosen)
        with interrupts() as listening:
            cameras, drawn = load_camera_path(path), _load(occluders)
            held = None if pvs is None else load_pvs(pvs)
            read = load_scene(scene, transparent=options.transparent)  # last, for it takes longest
            sets = None
            if held is not None:
                sets = VisibleSets.of(held, whole_scene(scene, read), read, hiding_of(scene, read))
            make_folder(output)
            flown = _fly(read, drawn, cameras, options, sets, listening)
            with listening.deferred():  # what was measured is not to be lost to a late Ctrl-C
                for name, data in flythrough_files(flown, followed(scene).name):
                    with listening.held():
                        write_whole(output / name, data)
                print_rows(
                    f"{followed(scene).name}, {path.name}", summary_rows(flown), read.warnings
                )
                print_text(COUNTED)
                for table in drawn_tables(flown):
                    print_table(*table)
                made = f"cull.csv, cull.json, walk.html, cull.png and frames.png in {output}"
                print_closing(made, _good(flown), f"open {output / 'walk.html'}")
                print_json(summary(flown, followed(scene).name))
        if not flown.complete:
            frames = f"{len(flown.frames):,} of {len(cameras.cameras):,} frames"
            print_line(f"warning: interrupted after {frames}; {output} holds what they gave")

    run_guarded(run, debug=debug, quiet=quiet, as_json=as_json)


def _good(flown: Flythrough) -> str:
    """How good the occluders are, in a line."""
    parts = flown.total.parts
    hidden = "no part is hidden along this path"
    if parts.recall is not None:
        hidden = f"{percent(parts.recall)} of the {count(parts.hidden, 'hidden part')} are culled"
    return f"{hidden}; wrong pixels: {pixel_words(flown.total)}"


def _load(occluders: Path) -> OccluderTree | Scene:
    """What is a file holds occluders as objects, whatever they look like."""
    if is_file(occluders):
        if occluders.name in (SCENE_FILE, PACKED_FILE):
            raise OptionError(
                f"{occluders} is one file of a folder of occluders",
                where="--occluders", remedy=f"give the folder, {occluders.parent}",
            )  # fmt: skip
        return load_scene(occluders, transparent="keep")
    return load_occluder_tree(occluders)


def _fly(
    read: Scene, occluders: OccluderTree | Scene, path: CameraPath, options: CullOptions,
    sets: VisibleSets | None, listening: Interrupts,
) -> Flythrough:  # fmt: skip
    with listening.deferred() as cancel, run_bar(len(path.cameras)) as tell:
        return fly(read, occluders, path, options, tell, cancel, sets)
