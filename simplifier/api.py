"""The functions of the library that a script calls; :mod:`simplifier` exports them.

Each takes the options of its command as one object, as keywords, or as both: ``simplify(mesh,
options, budget=32)`` is ``options`` with another budget.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.front import measure_front
from simplifier.accuracy.overhang import measure_overhang
from simplifier.checks import as_path, check_callable, check_cancel, check_kind
from simplifier.device.choice import open_device
from simplifier.device.remembering import remembering
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.occluder import AN_OCCLUDER, LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.geometry.scene import Scene
from simplifier.io.save import save_lods, save_occluder
from simplifier.kernels.front import load_for
from simplifier.lods.level_plan import plan_levels
from simplifier.lods.levels import Levels, simplify_levels
from simplifier.memory.need import MeshSize
from simplifier.memory.runs import check_making, check_options, need_of_judging, need_of_solid
from simplifier.options.fields import changed, passed_on
from simplifier.options.scene import SceneOptions
from simplifier.options.simplify import EvaluateOptions, Sides, SimplifyOptions, Style
from simplifier.options.stages import stage_options
from simplifier.pipeline import Simplification, simplify_mesh
from simplifier.production.estimate import judging_of
from simplifier.production.evaluation import EvaluateResult
from simplifier.production.result import SimplifyResult
from simplifier.progress import Cancel, Listener, Stopwatch, TellCount
from simplifier.steps.solid import solidify

if TYPE_CHECKING:
    from simplifier.hierarchy.occluder_tree import OccluderTree


def simplify(
    mesh: TriangleMesh,
    options: SimplifyOptions | None = None,
    *,
    overrides: Overrides = NO_OVERRIDES,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    **changes: Any,
) -> SimplifyResult:
    """Make an occluder, to be drawn double-sided, or levels of detail where they are asked for.

    ``mesh``       any soup; from arrays: ``TriangleMesh.from_soup(vertices, faces)``.
    ``options``    as :class:`SimplifyOptions` says, or its fields as ``changes``.
    ``overrides``  parts drawn by hand, which count towards the budget, and regions to leave open,
                   as :func:`load_overrides` reads them; what they ignore is for :func:`load`.
    ``listener``   called with the :class:`Progress` so far; what it raises ends the run.
    ``cancel``     a :class:`threading.Event` or alike: once it is set, from any thread or by the
                   listener, the call ends soon.  It returns the best so far when refining (of the
                   finest level) has begun, else it raises
                   :class:`~simplifier.errors.CancelledError`.

    The result has the ``occluder`` with its vertices, faces, error bound and timings, and, of
    levels, the ``chain``: ``chain.at(distance)`` is the one to use.  :meth:`SimplifyResult.save`
    writes it; :meth:`SimplifyResult.measure` tells precision and recall and gives the report.  A
    mesh of no more triangles than the budget is its own occluder, less what is buried in it, unless
    it is to keep wholly inside.  Levels that bring nothing are left out.

    The same mesh, options and seed give the same bytes on any number of threads, unless a time
    limit or a cancel ends the search.  Raises :class:`OccluderError`, and
    :class:`~simplifier.errors.MemoryLimitError` at once where making or measuring would need more
    than ``options.memory_limit``.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    chosen = changed(SimplifyOptions, options, changes)
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    longest, levels = float(mesh.extent.max()), chosen.levels
    stages = stage_options(chosen, longest)
    check_making(mesh, stages, chosen.memory_limit, judging_of(chosen))
    load_for(len(mesh.faces))
    made: Simplification | Levels
    if levels is None:
        made = simplify_mesh(mesh, stages, listener, cancel, overrides)
    else:
        plan = plan_levels(longest, stages, levels, len(overrides.triangles))
        made = simplify_levels(mesh, plan, listener, cancel, overrides)
    return SimplifyResult(mesh, chosen, stages, made, overrides)


def evaluate(
    mesh: TriangleMesh,
    occluder: Occluder,
    options: EvaluateOptions | None = None,
    *,
    overrides: Overrides = NO_OVERRIDES,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    **changes: Any,
) -> EvaluateResult:
    """Measure an occluder, made here or elsewhere: precision, recall, and how far it strays.

    ``options``    as :class:`EvaluateOptions` says, or its fields as ``changes``.
    ``overrides``  of the mesh, which was loaded with what they ignore; the occluder is to keep
                   their regions open.
    ``listener``   called with the :class:`Progress` so far; what it raises ends the run.
    ``cancel``     once set, ends the run before its next stage with
                   :class:`~simplifier.errors.CancelledError`.

    Raises :class:`~simplifier.errors.OccluderError`.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("occluder", occluder, Occluder, AN_OCCLUDER)
    chosen = changed(EvaluateOptions, options, changes)
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    stages = stage_options(chosen, float(mesh.extent.max()))
    held = MeshSize(len(occluder.vertices), len(occluder.faces)).held
    check_options(
        lambda each: (
            need_of_solid(mesh, each)
            .joined(need_of_judging(mesh, each, judging_of(chosen)))
            .beside(held)
        ),
        stages,
        chosen.memory_limit,
    )
    load_for(len(mesh.faces))
    watch = Stopwatch(listener, cancel)
    solid = solidify(mesh, stages.solid, watch, Overrides(viewers=overrides.viewers))
    with watch.stage("accuracy"):
        device = remembering(open_device(chosen.device))
        accuracy = evaluate_accuracy(
            mesh, occluder, passed_on(AccuracyOptions, chosen), device=device
        )
        overhang = measure_overhang(mesh, occluder, accuracy.directions, device)
        front = measure_front(mesh, occluder, accuracy.directions, device)
    return EvaluateResult(
        mesh, occluder, chosen, stages, solid, accuracy, overhang, front, watch.timings, overrides
    )


def save(
    result: SimplifyResult | Occluder | LodChain,
    path: str | Path,
    *,
    sides: Sides = "double",
    quads: bool = False,
) -> None:
    """Write what was simplified, an occluder or levels of detail, in the format of the suffix.

    All or nothing is written.

    Levels go to one ``.glb`` by MSFT_lod, or one ``.occ``, which :func:`load_lods` reads, and one
    by one to ``NAME_lod0`` and so on beside it; for other formats to the latter alone.

    ``sides``  "single" for renderers that cull back faces: what can be seen from both sides is then
               there in both windings.
    ``quads``  write two triangles as a quad where they pair up, in formats that have quads.

    Raises :class:`~simplifier.errors.OutputError`.
    """
    kinds = SimplifyResult | Occluder | LodChain
    check_kind("result", result, kinds, "what simplify returns")
    style = Style(sides, quads)
    if isinstance(result, SimplifyResult):
        result.save(path, style)
    elif isinstance(result, LodChain):
        save_lods(result, path, style)
    else:
        save_occluder(result, path, style)


def simplify_scene(
    scene: Scene,
    folder: str | Path,
    options: SceneOptions | None = None,
    *,
    tell: TellCount = lambda done, total: None,
    cancel: Cancel | None = None,
    pool: str | None = None,
    **changes: Any,
) -> OccluderTree:
    """Make a tree of occluders for a scene of many objects, kept in ``folder``.

    ``options``  as :class:`SceneOptions` says, or its fields as ``changes``.
    ``tell``     called with how many occluders are there and how many there will be.
    ``cancel``   once set, ends the call soon by :class:`~simplifier.errors.CancelledError`; what is
                 made by then is kept.
    ``pool``     "ray" spreads the work over the nodes of a Ray cluster.

    What the folder holds of an earlier run and the scene still needs is not made again.  Work is
    spread over processes, so a script that calls this has to guard its main module (``if __name__
    == "__main__"``).  ``scene.json`` in the folder says what could not be made and why, and
    ``scene.occs`` is the same tree in one file for engines.  Raises :class:`OccluderError`.
    """
    # Here, not above: who makes one occluder need not load what makes scenes.
    from simplifier.hierarchy.occluder_tree import leaf_occluders
    from simplifier.hierarchy.packed_file import write_packed
    from simplifier.hierarchy.scene_build import build_occluders
    from simplifier.hierarchy.scene_file import (
        load_occluder_tree,
        occluder_store,
        read_earlier,
        write_manifest,
    )
    from simplifier.io.scene_writer import write_scene
    from simplifier.pools import pool_named

    check_kind("scene", scene, Scene, "what simplifier.load_scene returns")
    check_callable("tell", tell)
    check_cancel(cancel)
    chosen = changed(SceneOptions, options, changes)
    place = as_path("folder", folder)
    store = occluder_store(place)
    with pool_named(pool) as shared:
        build = build_occluders(
            scene, chosen, store, read_earlier(place).summaries, tell, cancel,
            chosen.memory_limit, shared,
        )  # fmt: skip
    write_manifest(place, scene, chosen, build)
    tree = load_occluder_tree(place)
    write_packed(place, tree)
    if chosen.preview:
        write_scene(leaf_occluders(tree), place / "preview.glb")
    return tree
