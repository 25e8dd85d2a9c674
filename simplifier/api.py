"""The functions of the library that a script calls; :mod:`simplifier` exports them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from simplifier.accuracy.accuracy import AccuracyOptions, AccuracyReport, evaluate_accuracy
from simplifier.checks import as_path, check_callable, check_cancel, check_kind
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.occluder import LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.build import build_occluders
from simplifier.hierarchy.manifest import (
    load_occluder_tree,
    occluder_store,
    read_summaries,
    write_manifest,
)
from simplifier.hierarchy.occluder_tree import OccluderTree, leaf_occluders
from simplifier.hierarchy.options import SceneOptions
from simplifier.io import save_occluder, write_scene
from simplifier.io.save import save_lods
from simplifier.io.style import Sides, Style
from simplifier.lods.level_plan import plan_levels
from simplifier.lods.levels import simplify_levels
from simplifier.lods.options import LodOptions, finest_bound
from simplifier.memory.limit import check_need
from simplifier.memory.runs import Judging, check_making, seeing, size_of
from simplifier.options import Axis, Preset, Slicing, Trim, Viewers, make_options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Cancel, Listener, TellCount


def simplify(
    mesh: TriangleMesh,
    *,
    budget: int = 64,
    resolution: int | None = None,
    error_bound: float | None = None,
    up: Axis = "y",
    ground: bool = False,
    viewers: Viewers = "all",
    smallest_hole: float = 0.0,
    conservative: bool = False,
    shrink: float = 0.0,
    trim: Trim = "gain",
    slicer: Slicing = "cpu",
    preset: Preset = "balanced",
    min_precision: float = 0.995,
    moves: int | None = None,
    time_limit: float | None = None,
    seed: int = 0,
    overrides: Overrides = NO_OVERRIDES,
    memory_limit: float | None = None,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
) -> Occluder:
    """Make an occluder of at most ``budget`` triangles, to be drawn double-sided.

    A mesh of no more is its own, less what is buried in it, unless it is to keep wholly inside.

    ``mesh``         any soup; from arrays: ``TriangleMesh.from_soup(vertices, faces)``.
    ``resolution``   voxels along the longest edge, 64 if neither it is given nor
    ``error_bound``  the largest distance, world units, that the occluder may have from the
                     original's surface or its filled interior.
    ``up``, ``ground``  with ``ground`` the asset stands on its low end along ``up``.
    ``viewers``      ``all``, or ``above``: they look level or down, and ``ground`` is implied.
    ``smallest_hole``  world units; openings narrower than this count as closed.
    ``conservative``  keep wholly inside: what a closed mesh does not hide is never hidden.
    ``shrink``       world units; keep this deep inside, so that what is hidden from a point is
                     hidden from all points within this length of it; implies ``conservative``.
    ``trim``         ``gain``, or ``area`` as published.
    ``slicer``       ``cpu``, or ``gl`` for the OpenGL stencil buffer.
    ``preset``       ``draft``, ``balanced`` or ``best``: how much time to spend.
    ``min_precision``  what refining aims for at least: it hides less where its own views show less
                     than this share of it to be right.
    ``moves``        refining moves in place of the preset's, 0 for the cut as it is.
    ``time_limit``   seconds that this call may take, in place of moves: less shortens the preset's
                     work, more goes on refining.  Results then differ from run to run.
    ``overrides``    parts drawn by hand, which count towards the budget, and regions to leave open,
                     as :func:`load_overrides` reads them; what they ignore is for :func:`load`.
    ``memory_limit``  GiB that the process may need, half of the machine's by default: a call that
                     would need more is refused at once, by
                     :class:`~simplifier.errors.MemoryLimitError`.
    ``listener``     called with the :class:`Progress` so far; what it raises ends the run.
    ``cancel``       a :class:`threading.Event` or alike: once it is set, from any thread or by the
                     listener, the call ends soon.  It returns the best so far when refining has
                     begun, else it raises :class:`~simplifier.errors.CancelledError`.

    The result carries its vertices, faces, error bound and timings.  The same mesh, options and
    seed give the same bytes on any number of threads, unless a time limit or a cancel ends the
    search.  Raises :class:`OccluderError`.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    options = make_options(
        float(mesh.extent.max()), budget=budget, resolution=resolution,
        error_bound=error_bound, up=up, ground=ground, viewers=viewers,
        smallest_hole=smallest_hole, conservative=conservative, shrink=shrink, trim=trim,
        slicer=slicer, preset=preset, min_precision=min_precision, moves=moves,
        time_limit=time_limit, seed=seed,
    )  # fmt: skip
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    check_making(mesh, options, memory_limit)
    return simplify_mesh(mesh, options, listener, cancel, overrides).occluder


def simplify_lods(
    mesh: TriangleMesh,
    *,
    lods: int | None = None,
    error_bounds: Sequence[float] | None = None,
    pixel_error: float = 1.0,
    screen_height: int = 1080,
    fov: float = 60.0,
    budget: int = 64,
    resolution: int | None = None,
    error_bound: float | None = None,
    up: Axis = "y",
    ground: bool = False,
    viewers: Viewers = "all",
    smallest_hole: float = 0.0,
    trim: Trim = "gain",
    slicer: Slicing = "cpu",
    preset: Preset = "balanced",
    min_precision: float = 0.995,
    moves: int | None = None,
    time_limit: float | None = None,
    seed: int = 0,
    overrides: Overrides = NO_OVERRIDES,
    memory_limit: float | None = None,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
) -> LodChain:
    """Make levels of detail of one occluder, each with its own error bound, finest first.

    ``lods``         how many, 3 if neither it is given nor ``error_bounds``: the finest has the
                     ``resolution`` (or ``error_bound``) and the ``budget``, each further one half
                     of both.
    ``error_bounds``  in their place: the bound of each level, world units, in any order; budgets
                     fall in proportion to the resolutions.
    ``pixel_error``  pixels that a level's error may have where it is used, on a screen of
    ``screen_height`` pixels and a vertical field of view of ``fov`` degrees.
    ``time_limit``   seconds for all levels together.
    ``cancel``       ends the call with the levels so far, if the finest is there.

    All else as for :func:`simplify`; there is no ``conservative`` and no ``shrink``, whose error
    bound is 0 at any resolution.  Levels that bring nothing are left out, and ``left_out`` of the
    result says which and why.  ``chain.at(distance)`` is the level to use; :func:`save` writes all.
    Raises :class:`OccluderError`.
    """
    count = 3 if lods is None and error_bounds is None else lods
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    levels = LodOptions(count, error_bounds, pixel_error, screen_height, fov)
    longest = float(mesh.extent.max())
    finest = make_options(
        longest, budget=budget, resolution=resolution,
        error_bound=finest_bound(levels, resolution, error_bound), up=up, ground=ground,
        viewers=viewers, smallest_hole=smallest_hole, trim=trim, slicer=slicer, preset=preset,
        min_precision=min_precision, moves=moves, time_limit=time_limit, seed=seed,
    )  # fmt: skip
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    check_making(mesh, finest, memory_limit)
    plan = plan_levels(longest, finest, levels, len(overrides.triangles))
    return simplify_levels(mesh, plan, listener, cancel, overrides).chain


def save(
    result: Occluder | LodChain,
    path: str | Path,
    *,
    sides: Sides = "double",
    quads: bool = False,
) -> None:
    """Write an occluder or levels of detail in the format of the suffix, all or nothing.

    Levels go to one ``.glb`` by MSFT_lod, or one ``.occ``, which :func:`load_lods` reads, and one
    by one to ``NAME_lod0`` and so on beside it; for other formats to the latter alone.

    ``sides``  "single" for renderers that cull back faces: what can be seen from both sides is then
               there in both windings.
    ``quads``  write two triangles as a quad where they pair up, in formats that have quads.

    Raises :class:`~simplifier.errors.OutputError`.
    """
    check_kind("result", result, Occluder | LodChain, "what simplify or simplify_lods returns")
    style = Style(sides, quads)
    if isinstance(result, LodChain):
        save_lods(result, path, style)
    else:
        save_occluder(result, path, style)


def simplify_scene(
    scene: Scene,
    folder: str | Path,
    *,
    budget: int = 64,
    resolution: int = 64,
    width: int = 8,
    moves: int = 2400,
    up: Axis = "y",
    ground: bool = False,
    smallest_hole: float = 0.0,
    conservative: bool = False,
    pixel_error: float = 0.5,
    rows: int = 180,
    fov: float = 60.0,
    preview: bool = False,
    seed: int = 0,
    memory_limit: float | None = None,
    tell: TellCount = lambda done, total: None,
    cancel: Cancel | None = None,
) -> OccluderTree:
    """Make a tree of occluders for a scene of many objects, kept in ``folder``.

    Options as :class:`~simplifier.hierarchy.options.SceneOptions` says.  What the folder holds of
    an earlier run and the scene still needs is not made again.  Work is spread over processes, so
    a script that calls this has to guard its main module (``if __name__ == "__main__"``).

    ``memory_limit``  GiB that this process and those that it starts may need at most, half of the
                machine's by default; :class:`~simplifier.errors.MemoryLimitError` beyond.
    ``preview``  also writes all leaves' occluders to ``preview.glb`` there.
    ``tell``    called with how many occluders are there and how many there will be.
    ``cancel``  once set, ends the call soon by :class:`~simplifier.errors.CancelledError`; what is
                made by then is kept.

    ``scene.json`` in the folder says what could not be made and why.  Raises
    :class:`OccluderError`.
    """
    check_kind("scene", scene, Scene, "what simplifier.load_scene returns")
    check_callable("tell", tell)
    check_cancel(cancel)
    options = SceneOptions(
        budget, resolution, width, moves, up, ground, smallest_hole, conservative, pixel_error,
        rows, fov, seed,
    )  # fmt: skip
    place = as_path("folder", folder)
    store = occluder_store(place)
    build = build_occluders(
        scene, options, store, read_summaries(place), tell, cancel, memory_limit
    )
    write_manifest(place, scene, options, build)
    tree = load_occluder_tree(place)
    if preview:
        write_scene(leaf_occluders(tree), place / "preview.glb")
    return tree


def evaluate(
    mesh: TriangleMesh,
    occluder: Occluder,
    *,
    views: int = 256,
    image: int = 256,
    quads: int = 32_000,
    seed: int = 0,
    exact: bool = False,
    viewers: Viewers = "all",
    up: Axis = "y",
    memory_limit: float | None = None,
) -> AccuracyReport:
    """Judge an occluder against its mesh: precision and recall, over all views and by view.

    ``views``, ``image``, ``quads``  how many views, pixels a side and random quads a view.
    ``exact``  count all quads in place of a sample.
    ``viewers``, ``up``  with viewers ``above`` all views look level or down.
    ``memory_limit``  GiB that the process may need at most, as for :func:`simplify`.
    """
    options = AccuracyOptions(views, image, quads, seed, exact, viewers, up)
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    how = Judging(options.views, options.image, exact=exact)
    check_need(seeing(size_of(mesh), how), memory_limit)
    return evaluate_accuracy(mesh, occluder, options)
