"""From a triangle soup to a handful of triangles that hide nearly the same.

    import simplifier

    mesh = simplifier.load("castle.glb")
    occluder = simplifier.simplify(mesh, budget=64, ground=True)
    report = simplifier.evaluate(mesh, occluder)
    print(report.precision, report.recall)
    simplifier.save(occluder, "castle_occluder.glb")

    scene = simplifier.load_scene("city.glb")
    tree = simplifier.simplify_scene(scene, "city_occluders", ground=True)
    culler = simplifier.Culler(tree, simplifier.DepthBuffer())
    verdicts = culler.cull(camera).verdicts

    product = simplifier.produce(mesh, simplifier.SimplifyOptions(lods=3))   # as the command does
    product.save("castle_occluder.glb")
    json.dump(product.report(), file)

Errors are :class:`OccluderError` and its kinds.  Commands from outside use
:mod:`simplifier.cli.plugin` beside.  A name is imported when it is first used, so that
a process that only describes options or loads nothing stays without numpy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from simplifier.version import VERSION as __version__

if TYPE_CHECKING:
    from simplifier.accuracy.accuracy import AccuracyReport
    from simplifier.api import evaluate, save, simplify, simplify_lods, simplify_scene
    from simplifier.culling.cull import Culled, Culler
    from simplifier.culling.depth_buffer import DepthBuffer, Verdict
    from simplifier.errors import (
        BackendUnavailableError,
        CancelledError,
        EmptyMeshError,
        MemoryLimitError,
        MeshError,
        OccluderError,
        OptionError,
        OutputError,
        OverridesError,
        SceneError,
        TomlError,
        UnknownFormatError,
        UnreadableMeshError,
    )
    from simplifier.geometry.camera import Camera, CameraPath, Lens
    from simplifier.geometry.mesh import TriangleMesh
    from simplifier.geometry.occluder import Level, LodChain, Occluder
    from simplifier.geometry.overrides import Ignore, Overrides, Pattern
    from simplifier.geometry.scene import Scene
    from simplifier.hierarchy.manifest import load_occluder_tree
    from simplifier.hierarchy.occluder_tree import OccluderTree
    from simplifier.io import load_camera_path, load_lods, load_occluder, load_scene
    from simplifier.io import load_mesh as load
    from simplifier.io.overrides import load_overrides
    from simplifier.io.suffixes import MESH_SUFFIXES, OCCLUDER_SUFFIXES
    from simplifier.memory.limit import default_limit
    from simplifier.memory.need import BASE_BYTES, MemoryNeed
    from simplifier.option_fields import (
        EVALUATE_FIELDS,
        SCENE_FIELDS,
        SIMPLIFY_FIELDS,
        TRADEOFF_FIELDS,
        OptionField,
    )
    from simplifier.production.estimate import check_file, estimate_memory
    from simplifier.production.judge import Judgement, judge
    from simplifier.production.options import EvaluateOptions, SimplifyOptions, TradeoffOptions
    from simplifier.production.produce import Made, Product, make, produce
    from simplifier.production.viewing import save_for_viewing
    from simplifier.progress import STAGES, Progress
    from simplifier.report.viewpoint import Viewpoint, picture_of
    from simplifier.tradeoff.study import Study, sweep_tradeoff
    from simplifier.warmup import warm_up

__all__ = [
    "BASE_BYTES",
    "EVALUATE_FIELDS",
    "MESH_SUFFIXES",
    "OCCLUDER_SUFFIXES",
    "SCENE_FIELDS",
    "SIMPLIFY_FIELDS",
    "STAGES",
    "TRADEOFF_FIELDS",
    "AccuracyReport",
    "BackendUnavailableError",
    "Camera",
    "CameraPath",
    "CancelledError",
    "Culled",
    "Culler",
    "DepthBuffer",
    "EmptyMeshError",
    "EvaluateOptions",
    "Ignore",
    "Judgement",
    "Lens",
    "Level",
    "LodChain",
    "Made",
    "MemoryLimitError",
    "MemoryNeed",
    "MeshError",
    "Occluder",
    "OccluderError",
    "OccluderTree",
    "OptionError",
    "OptionField",
    "OutputError",
    "Overrides",
    "OverridesError",
    "Pattern",
    "Product",
    "Progress",
    "Scene",
    "SceneError",
    "SimplifyOptions",
    "Study",
    "TomlError",
    "TradeoffOptions",
    "TriangleMesh",
    "UnknownFormatError",
    "UnreadableMeshError",
    "Verdict",
    "Viewpoint",
    "__version__",
    "check_file",
    "default_limit",
    "estimate_memory",
    "evaluate",
    "judge",
    "load",
    "load_camera_path",
    "load_lods",
    "load_occluder",
    "load_occluder_tree",
    "load_overrides",
    "load_scene",
    "make",
    "picture_of",
    "produce",
    "save",
    "save_for_viewing",
    "simplify",
    "simplify_lods",
    "simplify_scene",
    "sweep_tradeoff",
    "warm_up",
]

_NAMES = {
    "api": (
        "evaluate",
        "save",
        "simplify",
        "simplify_lods",
        "simplify_scene",
    ),
    "culling.cull": (
        "Culled",
        "Culler",
    ),
    "culling.depth_buffer": (
        "DepthBuffer",
        "Verdict",
    ),
    "errors": (
        "BackendUnavailableError",
        "CancelledError",
        "EmptyMeshError",
        "MemoryLimitError",
        "MeshError",
        "OccluderError",
        "OptionError",
        "OutputError",
        "OverridesError",
        "SceneError",
        "TomlError",
        "UnknownFormatError",
        "UnreadableMeshError",
    ),
    "accuracy.accuracy": ("AccuracyReport",),
    "tradeoff.study": ("Study",),
    "report.viewpoint": (
        "Viewpoint",
        "picture_of",
    ),
    "geometry.camera": (
        "Camera",
        "CameraPath",
        "Lens",
    ),
    "geometry.lod_chain": (
        "Level",
        "LodChain",
    ),
    "geometry.mesh": ("TriangleMesh",),
    "geometry.occluder": ("Occluder",),
    "geometry.overrides": ("Ignore", "Overrides", "Pattern"),
    "geometry.scene": ("Scene",),
    "hierarchy.manifest": ("load_occluder_tree",),
    "hierarchy.occluder_tree": ("OccluderTree",),
    "io": (
        "load_camera_path",
        "load_lods",
        "load_occluder",
        "load_scene",
    ),
    "memory.limit": ("default_limit",),
    "memory.need": (
        "BASE_BYTES",
        "MemoryNeed",
    ),
    "option_fields": (
        "EVALUATE_FIELDS",
        "OptionField",
        "SCENE_FIELDS",
        "SIMPLIFY_FIELDS",
        "TRADEOFF_FIELDS",
    ),
    "io.overrides": ("load_overrides",),
    "production.estimate": (
        "check_file",
        "estimate_memory",
    ),
    "production.judge": (
        "Judgement",
        "judge",
    ),
    "production.options": (
        "EvaluateOptions",
        "SimplifyOptions",
        "TradeoffOptions",
    ),
    "production.produce": (
        "Made",
        "Product",
        "make",
        "produce",
    ),
    "tradeoff.produce": ("sweep_tradeoff",),
    "production.viewing": ("save_for_viewing",),
    "progress": (
        "Progress",
        "STAGES",
    ),
    "io.suffixes": (
        "MESH_SUFFIXES",
        "OCCLUDER_SUFFIXES",
    ),
    "warmup": ("warm_up",),
}
_PLACES = {name: (module, name) for module, names in _NAMES.items() for name in names}
_PLACES["load"] = ("io", "load_mesh")


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _PLACES[name]
    value = getattr(import_module(f"{__name__}.{module}"), attribute)
    globals()[name] = value  # asked for once
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
