"""A mesh or a scene to a file that a browser can show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path, check_kind, check_whole
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.views import BoundingSphere
from simplifier.io.files import write_whole
from simplifier.io.glb_writer import encode_surface
from simplifier.refinement.reduce import reduce_to


def save_for_viewing(
    mesh: TriangleMesh, path: str | Path, *, most_triangles: int = 300_000
) -> None:
    """Write a GLB to look at beside an occluder, not to work with: larger meshes are thinned.

    ``most_triangles``  1,000 or more.  A node's extras tell the ``bounding_sphere`` of the mesh as
    it was, which accuracy is measured in.  Raises :class:`~simplifier.errors.OutputError` and
    :class:`~simplifier.errors.OptionError`.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_whole("most_triangles", most_triangles, 1000, 100_000_000)
    shown = reduce_to(mesh, most_triangles)
    write_whole(as_path("path", path), encode_surface(shown, BoundingSphere.of(mesh)))


_CORNERS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
_SIDES = np.array(
    [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
     [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]], dtype=np.int32,
)  # fmt: skip


def save_scene_for_viewing(
    scene: Scene, path: str | Path, *, most_triangles: int = 300_000
) -> NDArray[np.int64]:
    """Write a GLB of all objects, one after the other; (n,) int64 how many triangles each has.

    ``most_triangles``  1,000 or more.  Objects that would go beyond are shown as boxes, the largest
    first.  As :func:`save_for_viewing` does, it tells the ``bounding_sphere`` and raises.
    """
    check_kind("scene", scene, Scene, "what simplifier.load_scene returns")
    check_whole("most_triangles", most_triangles, 1000, 100_000_000)
    counts = scene.triangle_counts
    small = np.argsort(counts, kind="stable")
    boxed = len(_SIDES) * np.arange(len(scene) - 1, -1, -1)  # of all that are larger
    whole = np.empty(len(scene), dtype=np.bool_)
    whole[small] = np.cumsum(counts[small]) + boxed <= most_triangles
    whole |= counts <= len(_SIDES)
    shown = _with_boxes(scene, ~whole).joined(range(len(scene)))
    write_whole(as_path("path", path), encode_surface(shown, BoundingSphere.of(shown)))
    return np.where(whole, counts, len(_SIDES))


def _with_boxes(scene: Scene, boxed: NDArray[np.bool_]) -> Scene:
    """The scene with the boxes of some objects (n,) in place of their meshes."""
    low, high = scene.bounds()[boxed].swapaxes(0, 1)
    transforms, mesh_of = scene.transforms.copy(), scene.mesh_of.copy()
    transforms[boxed] = np.eye(4)
    transforms[boxed, :3, 3] = low
    transforms[np.flatnonzero(boxed)[:, None], range(3), range(3)] = high - low
    mesh_of[boxed] = len(scene.meshes)
    box = TriangleMesh(_CORNERS.copy(), _SIDES.copy())
    return Scene((*scene.meshes, box), scene.names, mesh_of, transforms)
