"""A mesh to a file that a browser can show."""

from __future__ import annotations

from pathlib import Path

from simplifier.checks import as_path, check_kind, check_whole
from simplifier.geometry.mesh import A_MESH, TriangleMesh
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
