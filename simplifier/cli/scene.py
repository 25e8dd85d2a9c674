"""The commands on scenes of many objects."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.cli.console import count_bar, print_closing, print_json, print_rows
from simplifier.cli.help import OUTPUT, with_examples
from simplifier.cli.options import SceneArgument, TransparentScene, read_options, with_options
from simplifier.cli.running import AsJson, Debug, Quiet, interrupts, run_guarded
from simplifier.culling.ranking import around, found_within, rank_occluders
from simplifier.errors import MeshError, OptionError, SceneError
from simplifier.geometry import scene as scenes
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.hierarchy.occluder_tree import leaf_occluders
from simplifier.hierarchy.packed_file import PACKED_FILE, current_packed, write_packed, write_ranked
from simplifier.hierarchy.scene_build import Build, build_occluders
from simplifier.hierarchy.scene_file import (
    load_occluder_tree,
    occluder_store,
    read_summaries,
    write_manifest,
)
from simplifier.io.camera_path import load_camera_path
from simplifier.io.files import check_folder, make_folder, write_whole
from simplifier.io.occs_file import decode_occs
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import PathKind, PathOptions, SceneOptions
from simplifier.wording import count

_RANKING_FRAMES = 60  # every other one ranks, the others judge


@with_examples(
    ("occluder scene town.glb -o town", "Make occluders for every object of a scene."),
    (
        "occluder scene town.glb -o town --up z --ground",
        "The same, for a scene whose z axis is up and whose buildings stand on the ground.",
    ),
    (
        "occluder scene town.glb -o town --budget 32 --preview",
        "Use fewer triangles, and write preview.glb to look at.",
    ),
)
@with_options(SceneOptions)
def scene(
    source: SceneArgument,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Folder for scene.json and the occluders.",
            rich_help_panel=OUTPUT,
        ),
    ],
    *,
    packed: Annotated[
        Path | None,
        typer.Option(
            help="Also write the tree and all occluders to this file, for engines (.occs). The"
            " folder always has them as scene.occs.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    frame_triangles: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Rank the occluders in the files for engines, for frames of so many occluder"
            " triangles, by what each hides along a path.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            help="The camera path to rank along. Without one, a walk is made.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    transparent: TransparentScene = "leave-out",
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make a tree of occluders for a scene of many objects.

    Occluders that are current are kept. An interrupted run continues where it stopped, and after a
    change of one object only its own occluders and those above it are made again.
    """

    def run() -> None:
        options = read_options(SceneOptions, chosen)
        if packed is not None:
            check_folder(packed)  # now, not when all is made
        if path is not None and frame_triangles is None:
            raise OptionError(
                "a path is for ranking", where="--path", remedy="give --frame-triangles, too"
            )
        given = None if path is None else load_camera_path(path)
        with interrupts() as listening:
            read = load_scene(source, transparent=transparent, memory_limit=options.memory_limit)
            make_folder(output)  # a scene that cannot be read leaves nothing behind
            with listening.deferred() as cancel, count_bar("occluders") as tell:
                build = build_occluders(
                    read, options, occluder_store(output), read_summaries(output), tell, cancel,
                    options.memory_limit,
                )  # fmt: skip
            with listening.held():
                write_manifest(output, read, options, build)
                data = _write_tree(output, options.preview)
            rows = _summary_rows(read, build, len(data))
            if frame_triangles is not None:
                cameras = (given or _walk(read, options)).cameras
                data, told = _rank(output, data, cameras, options, frame_triangles)
                rows.append(("ranked", told))
            if packed is not None:
                with listening.held():
                    write_whole(packed, data)
            print_rows(str(output), rows, [*read.warnings, *build.warnings])
            print_closing(_made(output, build), _NOT_MEASURED, _then(source, output, options))
            print_json(_figures(read, build))

    run_guarded(run, debug=debug, quiet=quiet, as_json=as_json)


_NOT_MEASURED = "not measured yet: how much the occluders hide depends on the camera"


def _made(output: Path, build: Build) -> str:
    if not build.made:
        return f"nothing; all {count(build.kept, 'occluder')} in {output} are current"
    return f"{count(build.made, 'occluder')} in {output}; {build.kept:,} were current"


def _then(source: Path, output: Path, options: SceneOptions) -> str:
    """How to find out what they hide."""
    walk = shlex.quote(f"{output}_walk.json")
    scene, folder = shlex.quote(str(source)), shlex.quote(str(output))
    up = "" if options.up == "y" else f" --up {options.up}"
    measure = f"occluder cull {scene} --occluders {folder} --path {walk} -o {folder}_cull"
    return f"occluder path {scene} -o {walk}{up} && {measure}"


def _figures(read: scenes.Scene, build: Build) -> dict[str, Any]:
    return {
        "objects": len(read),
        "parts": len(build.parts.object_of),
        "triangles": int(read.triangle_counts.sum()),
        "nodes": len(build.tree),
        "occluders": len(build.summaries),
        "occluder_triangles": sum(one.triangles for one in build.summaries.values()),
        "made": build.made,
        "kept": build.kept,
        "warnings": [*read.warnings, *build.warnings],
    }


def _write_tree(output: Path, preview: bool) -> bytes:
    """Write what is made of ``scene.json`` and the occluders; the bytes of ``scene.occs``."""
    data = current_packed(output)
    if data is None or preview:
        tree = load_occluder_tree(output)
        data = data or write_packed(output, tree)
        if preview:
            write_scene(leaf_occluders(tree), output / "preview.glb")
    return data


def _walk(read: scenes.Scene, options: SceneOptions) -> CameraPath:
    """Through the scene, of the first kind that there is room for."""
    # Here, not above: what it needs of scipy takes longer to load than a small change to build.
    from simplifier.camera_paths.generate import generate_path

    kinds: tuple[PathKind, ...] = ("street", "inside", "roof")
    for kind in kinds:
        try:
            return generate_path(read, PathOptions(kind, _RANKING_FRAMES, options.up))
        except MeshError:
            continue
    raise SceneError(
        "there is no way through the scene to rank its occluders along",
        remedy="give a camera path with --path",
    )


def _rank(
    output: Path, data: bytes, cameras: Sequence[Camera], options: SceneOptions, most: int
) -> tuple[bytes, str]:
    """Rank by every other camera, and judge by those between; the bytes of ``scene.occs``, and what
    to tell."""
    tree = decode_occs(data, PACKED_FILE)
    views = [view for camera in cameras[::2] for view in around(camera)]
    others = [view for camera in cameras[1::2] for view in around(camera)] or views
    size = options.rows, options.rows * 16 // 9
    with count_bar("views") as tell:
        ranking = rank_occluders(tree, views, *size, tell)
    whole = found_within(tree, others, *size, None)
    before = found_within(tree, others, *size, most)
    after = found_within(ranking.tree, others, *size, most)
    told = (
        f"{ranking.useful:,} of {ranking.drawn:,} occluders that {len(views):,} views drew; within"
        f" {most:,} triangles a frame {_share(after, whole)} of what the whole tree finds from"
        f" other views, {_share(before, whole)} without ranks"
    )
    return write_ranked(output, ranking.tree, most), told


def _share(count: int, whole: int) -> str:
    return f"{count / max(whole, 1):.1%}"


def _summary_rows(read: scenes.Scene, build: Build, packed: int) -> list[tuple[str, str]]:
    far = sum(keys.far is not None for keys in build.keys)
    near = sum(keys.near is not None for keys in build.keys)
    triangles = sum(one.triangles for one in build.summaries.values())
    return [
        ("objects", f"{len(read):,}"),
        ("parts", f"{len(build.parts.object_of):,}"),
        ("triangles", f"{int(read.triangle_counts.sum()):,}"),
        ("nodes", f"{len(build.tree):,}, of which {far:,} with a far and {near:,} a near occluder"),
        ("occluders", f"{len(build.summaries):,} of {triangles:,} triangles"),
        ("made now", f"{build.made:,}, {build.kept:,} kept from before"),
        ("for engines", f"{PACKED_FILE}, {packed:,} bytes"),
    ]
