"""Scene -> its tree of occluders in a folder, and what the command tells of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import typer

from simplifier.cli.console import count_bar, print_line, print_progress
from simplifier.cli.running import INTERRUPTED, Interrupts
from simplifier.errors import CancelledError, MeshError, SceneError
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import leaf_occluders
from simplifier.hierarchy.packed_file import (
    PACKED_FILE,
    read_packed,
    write_meshes,
    write_ranked,
)
from simplifier.hierarchy.packing import WeldedMesh
from simplifier.hierarchy.scene_build import Build, build_occluders
from simplifier.hierarchy.scene_file import (
    SCENE_FILE,
    load_occluder_tree,
    occluder_store,
    outline_of,
    read_earlier,
    write_manifest,
)
from simplifier.io.camera_path import load_camera_path
from simplifier.io.files import make_folder
from simplifier.io.occs_file import decode_occs
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import PathKind, PathOptions, SceneOptions
from simplifier.pools import Pool

_PREVIEW = "preview.glb"
_RANKING_FRAMES = 60  # every other one ranks, the others judge


@dataclass(frozen=True)
class Made:
    """Tables, figures and warnings to be ``told`` of it, and ``told_again`` once all of it is
    current; the ``files`` that hold it."""

    told: dict[str, Any]
    told_again: dict[str, Any]
    files: list[Path]


def make_scene(
    source: Path,
    output: Path,
    options: SceneOptions,
    transparent: Literal["leave-out", "keep"],
    ranking: tuple[int | None, Path | None],
    listening: Interrupts,
    pool: Pool | None = None,
) -> Made:
    """``ranking``  the triangles a frame to rank occluders for, if they are, and the camera path to
    rank along, if one was given.  ``pool``  makes the occluders in place of this machine."""
    most, path = ranking
    given = None if path is None else load_camera_path(path)
    read = load_scene(source, transparent=transparent, memory_limit=options.memory_limit)
    make_folder(output)  # a scene that cannot be read leaves nothing behind
    store, earlier = occluder_store(output), read_earlier(output)
    try:
        with listening.deferred() as cancel, count_bar("occluders") as tell:
            build = build_occluders(
                read, options, store, earlier.summaries, tell, cancel, options.memory_limit,
                pool, print_progress,
            )  # fmt: skip
    except (KeyboardInterrupt, CancelledError):
        print_line(f"error: interrupted; {output} keeps the occluders that were made, run it again"
                   " for the rest")  # fmt: skip
        raise typer.Exit(INTERRUPTED) from None
    with listening.held():
        packed = read_packed(output)
        known = packed.meshes(earlier.keys) if packed else {}  # before there is another manifest
        write_manifest(output, read, options, build)
        if packed and packed.is_current():
            data = packed.data
        else:
            data = _write_tree(output, read, options, build, known)
        if options.preview:
            write_scene(leaf_occluders(load_occluder_tree(output)), output / _PREVIEW)
    ranked = []
    if most is not None:
        cameras = (given or _walk(read, options)).cameras
        data, words = _rank(output, data, cameras, options, most)
        ranked = [("ranked", words)]
    made = [output / SCENE_FILE, output / PACKED_FILE, *map(store.path, build.summaries)]
    again = replace(build, made=0, kept=build.made + build.kept)
    return Made(
        _told(read, build, len(data), ranked),
        _told(read, again, len(data), ranked),
        [*made, output / _PREVIEW] if options.preview else made,
    )


def _told(read: Scene, build: Build, packed: int, ranked: list[tuple[str, str]]) -> dict[str, Any]:
    warnings = [*read.warnings, *build.warnings]
    rows = [*_summary_rows(read, build, packed), *ranked]
    return {"rows": rows, "warnings": warnings, "figures": _figures(read, build)}


def _figures(read: Scene, build: Build) -> dict[str, Any]:
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


def _write_tree(
    output: Path,
    read: Scene,
    options: SceneOptions,
    build: Build,
    known: Mapping[str, WeldedMesh],
) -> bytes:
    """Write ``scene.occs``; its bytes.  Occluders are read where neither this build nor the file of
    the last one has them: thousands take longer than all else of a small change."""
    outline, keys = outline_of(read, options, build)
    store, meshes = occluder_store(output), {**known, **build.meshes}

    def mesh(key: str) -> WeldedMesh:
        if key in meshes:
            return meshes[key]
        return WeldedMesh.of(store.read(key, build.summaries[key].checksum))

    return write_meshes(output, outline, map(mesh, keys))


def _walk(read: Scene, options: SceneOptions) -> CameraPath:
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
    # Here, not above: few builds rank, and what draws depths takes a while to load.
    from simplifier.culling.ranking import around, found_within, rank_occluders

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
    return f"{100.0 * count / max(whole, 1):.1f} %"


def _summary_rows(read: Scene, build: Build, packed: int) -> list[tuple[str, str]]:
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
