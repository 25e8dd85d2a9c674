"""A mesh or a scene to a file that a browser can show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path, check_kind, check_whole
from simplifier.geometry.boxed_scene import with_boxes
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


def save_scene_for_viewing(
    scene: Scene, path: str | Path, *, most_triangles: int = 300_000
) -> NDArray[np.int64]:
    """Write a GLB of all objects, one after the other; (n,) int64 how many triangles each has.

    ``most_triangles``  1,000 or more.  Objects that would go beyond are shown as boxes, the largest
    first.  As :func:`save_for_viewing` does, it tells the ``bounding_sphere`` and raises.
    """
    check_kind("scene", scene, Scene, "what simplifier.load_scene returns")
    check_whole("most_triangles", most_triangles, 1000, 100_000_000)
    shown, counts = with_boxes(scene, most_triangles)
    joined = shown.joined(range(len(shown)))
    write_whole(as_path("path", path), encode_surface(joined, BoundingSphere.of(joined)))
    return counts
