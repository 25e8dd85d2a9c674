"""Other ways to few triangles with Python bindings, each asked for a budget as its documentation
says.

They get the mesh with equal vertices merged, centred and scaled to unit size: their best case.
Simplifiers do not promise a budget; what they return is judged as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from bench.boxes import convex_boxes
from bench.failure import PeerFailedError
from bench.hulls import convex_hull
from bench.inner_boxes import TRIANGLES, inner_boxes
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.options.stages import make_options
from simplifier.progress import Stopwatch
from simplifier.steps.solid import solidify

Faces = NDArray[np.int64]
Peer = Callable[[FloatArray, Faces, int], tuple[FloatArray, Faces]]

_NO_LIMIT = 1e9  # error allowed, in extents of the mesh: the budget alone is to stop them
_BOX_VOXELS = 64  # along the longest edge, that inner boxes are made of


def fast_simplification(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """Quadric edge collapse (fast-simplification)."""
    found = import_module("fast_simplification").simplify(
        points, faces.astype(np.int32), target_count=budget
    )
    return found[0], found[1].astype(np.int64)


def meshoptimizer(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """Quadric edge collapse that keeps the topology (meshoptimizer, simplify)."""
    return points, _collapsed(import_module("meshoptimizer").simplify, points, faces, budget)


def meshoptimizer_prune(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """The same, small components given up as well (meshoptimizer, SIMPLIFY_PRUNE)."""
    library = import_module("meshoptimizer")
    simplify = partial(library.simplify, options=library.SIMPLIFY_PRUNE)
    return points, _collapsed(simplify, points, faces, budget)


def meshoptimizer_sloppy(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """Vertex clustering (meshoptimizer, simplifySloppy)."""
    return points, _collapsed(import_module("meshoptimizer").simplify_sloppy, points, faces, budget)


def pymeshlab(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """Quadric edge collapse (MeshLab)."""
    library = import_module("pymeshlab")
    meshes = library.MeshSet(verbose=False)
    meshes.add_mesh(library.Mesh(points, faces))
    try:
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=budget)
    except library.PyMeshLabException as error:
        raise PeerFailedError(f"pymeshlab refuses it ({error})") from None
    made = meshes.current_mesh()
    return made.vertex_matrix(), made.face_matrix().astype(np.int64)


def voxel_boxes(points: FloatArray, faces: Faces, budget: int) -> tuple[FloatArray, Faces]:
    """Axis-aligned boxes of voxels that this library holds to be wholly inside."""
    mesh = TriangleMesh.from_soup(points, faces)
    options = make_options(float(mesh.extent.max()), resolution=_BOX_VOXELS).solid
    solid = solidify(mesh, options, Stopwatch())
    inside = solid.filled.with_inside(solid.filled.inside & ~solid.touched.inside)
    return inner_boxes(inside, budget // TRIANGLES)


PEERS: dict[str, Peer] = {
    "fast-simplification": fast_simplification,
    "meshoptimizer": meshoptimizer,
    "meshoptimizer prune": meshoptimizer_prune,
    "meshoptimizer sloppy": meshoptimizer_sloppy,
    "pymeshlab": pymeshlab,
    "convex hull": convex_hull,
    "inner boxes": voxel_boxes,
    "coacd boxes": convex_boxes,
}
"""By the name that tables show; the first word is the package, but for those of :data:`OWN`."""

OWN = ("convex hull", "inner boxes")
"""Well-known ways that need no package beside those of this library."""

SLOW_PEERS = ("coacd boxes",)
"""Those that take minutes on a large mesh; what takes longer than their limit is skipped."""


def missing(name: str) -> str:
    """Why a peer has to be skipped, empty when its package is there."""
    if name in OWN:
        return ""
    package = name.split()[0]
    found = find_spec(package.replace("-", "_"))
    return "" if found else f"{package} is not installed (pip install -e '.[bench]')"


def prepared(mesh: TriangleMesh) -> TriangleMesh:
    """Equal vertices merged, triangles that collapse by it dropped; centre 0, longest edge 1."""
    points, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    low, high = mesh.bounds
    scaled = (points - (low + high) / 2.0) / (high - low).max()
    return TriangleMesh.from_soup(scaled, place.ravel()[mesh.faces])


def simplified(peer: Peer, mesh: TriangleMesh, budget: int) -> tuple[FloatArray, Faces]:
    """What the peer makes of a :func:`prepared` mesh."""
    return peer(mesh.vertices.copy(), mesh.faces.astype(np.int64), budget)  # peers want to write


def occluder_from(made: tuple[FloatArray, Faces], mesh: TriangleMesh) -> Occluder:
    """A peer's result back in the world of the original ``mesh``."""
    points, faces = made
    low, high = mesh.bounds
    world = np.array(points, dtype=np.float64) * (high - low).max() + (low + high) / 2.0
    used, renumbered = np.unique(faces, return_inverse=True)
    return Occluder(world[used], renumbered.reshape(-1, 3).astype(np.int32))


def _collapsed(
    simplify: Callable[..., int], points: FloatArray, faces: Faces, budget: int
) -> Faces:
    positions = np.ascontiguousarray(points, dtype=np.float32)
    indices = np.ascontiguousarray(faces.ravel(), dtype=np.uint32)
    kept = np.zeros_like(indices)
    count = simplify(
        kept, indices, positions, target_index_count=3 * budget, target_error=_NO_LIMIT
    )
    return kept[:count].reshape(-1, 3).astype(np.int64)
