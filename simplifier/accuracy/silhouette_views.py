"""A mesh and occluders as silhouettes show them: what quads and overhang are counted in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from simplifier.device.device import Device, Surface
from simplifier.errors import MeshError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import BoundingSphere, image_axes
from simplifier.kernels.coverage import MaskArray

_BLOCK_BYTES = 1 << 26  # masks held at once, original and occluders together

_Counted = TypeVar("_Counted")


@contextmanager
def occluder_refused() -> Iterator[None]:
    """Tell of a ValueError as a fault of the occluder: a mesh is checked when it is made."""
    try:
        yield
    except ValueError as error:
        raise MeshError(str(error), where="occluder", remedy="repair its arrays") from error


@dataclass(frozen=True, eq=False)
class SilhouetteViews:
    """Views along unit vectors, in the space of the mesh's bounding sphere.

    ``mesh``, ``occluders``  there: the sphere is the unit sphere.
    ``projections``  (V, 2, 4): pixels across and up.
    ``image``        pixels a side of a picture.
    """

    mesh: Surface
    occluders: Sequence[Surface]
    projections: FloatArray
    image: int

    @classmethod
    def of(
        cls,
        mesh: TriangleMesh,
        occluders: Sequence[Occluder],
        directions: FloatArray,
        image: int,
        across: int | None = None,
    ) -> SilhouetteViews:
        """Along ``directions`` (V, 3); ``across`` of the picture's pixels span the original's
        bounding sphere, all of them by default."""
        sphere = BoundingSphere.of(mesh)
        projections = np.empty((len(directions), 2, 4))
        projections[:, :, :3] = image_axes(directions)[:, :2] * ((across or image) / 2.0)
        projections[:, :, 3] = image / 2.0
        original = (sphere.to_unit(mesh.vertices), mesh.faces)
        hidden = [(sphere.to_unit(one.vertices), one.faces) for one in occluders]
        return cls(original, hidden, projections, image)

    def blocks(self) -> Iterator[tuple[int, int]]:
        """First and last (exclusive) of views that take bounded memory together."""
        bytes_a_view = (1 + len(self.occluders)) * self.image * 8 * -(-self.image // 64)
        block = max(4, _BLOCK_BYTES // bytes_a_view)
        for first in range(0, len(self.projections), block):
            yield first, min(first + block, len(self.projections))

    def counted(
        self,
        count: Callable[[Surface, Sequence[Surface], FloatArray, int], _Counted],
        first: int,
        last: int,
    ) -> _Counted:
        """What ``count`` gives for the mesh, the occluders, the projections of views ``first`` to
        ``last`` (exclusive) and the picture's size.

        Raises :class:`~simplifier.errors.MeshError` when an occluder's arrays cannot be drawn.
        """
        with occluder_refused():
            return count(self.mesh, self.occluders, self.projections[first:last], self.image)

    def masks(self, device: Device, first: int, last: int) -> list[MaskArray]:
        """Bit rows of the mesh and of each occluder, as of
        :func:`~simplifier.kernels.coverage.coverage_masks`; raises as :meth:`counted`."""
        return self.counted(
            lambda mesh, occluders, projections, image: [
                device.coverage_masks(*one, projections, image, image) for one in (mesh, *occluders)
            ],
            first,
            last,
        )
