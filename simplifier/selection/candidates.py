"""Chain[] -> Candidates: every polygon at every level, ready to be drawn and scored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplifier.device.device import PROCESSOR, Device
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.section import Chain, signed_area
from simplifier.kernels.bit_image import SIZE
from simplifier.kernels.measure import draw_polygon, score_images
from simplifier.progress import TellShare, silent

Images = NDArray[np.uint64]
"""(views, 64) uint64: one 64 x 64 bit image a view."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Polygons laid end to end, and their maps into the pictures of all search views.

    ``standing`` (V, 64) is what is hidden already, whichever are chosen; the ``device`` scores many
    of them at once.

    Arrays as :mod:`simplifier.kernels.measure` takes them.  ``triangles`` (p,) int32 is the
    triangle count of each full polygon.  Scores are twice the occlusion measure summed over the
    views, in cubic pixels: whole numbers, so ties and sums are exact.
    """

    points: FloatArray
    lowest: IntArray
    offsets: NDArray[np.int64]
    maps: FloatArray
    triangles: IntArray = field(repr=False)
    standing: Images = field(repr=False)
    device: Device = PROCESSOR

    @classmethod
    def from_chains(
        cls,
        chains: Sequence[Chain],
        projections: FloatArray,
        standing: Images | None = None,
        device: Device = PROCESSOR,
    ) -> Candidates:
        """``projections`` (views, 2, 4): grid space to pixels of 64 x 64 images, affine."""
        if standing is None:
            standing = np.zeros((len(projections), SIZE), dtype=np.uint64)
        sizes = np.array([len(chain.ring) for chain in chains], dtype=np.int64)
        points = [chain.ring for chain in chains] or [np.empty((0, 2))]
        lowest = [chain.lowest for chain in chains] or [np.empty(0, np.int32)]
        return cls(
            np.ascontiguousarray(np.concatenate(points)),
            np.concatenate(lowest).astype(np.int32, copy=False),
            np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
            _maps(chains, projections),
            (sizes - 2).astype(np.int32),
            standing,
            device,
        )

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def views(self) -> int:
        return int(self.maps.shape[1])

    def nothing(self) -> Images:
        """Empty images."""
        return np.zeros((self.views, SIZE), dtype=np.uint64)

    def draw(self, polygon: int, level: int) -> Images:
        """The images of one polygon at one level."""
        images = self.nothing()
        draw_polygon(self.points, self.lowest, self.offsets, self.maps, polygon, level, images)
        return images

    def scores(
        self, polygons: IntArray, levels: IntArray, base: Images, tell: TellShare = silent
    ) -> NDArray[np.int64]:
        """(k,) score of ``base`` with each of the (k,) polygons added, one at a time."""
        shapes = (self.points, self.lowest, self.offsets, self.maps)
        return self.device.polygon_scores(shapes, polygons, levels, base, tell)

    def full_gains(self, tell: TellShare = silent) -> NDArray[np.int64]:
        """(p,) what each polygon adds in full to the score of what stands already.

        A level lies in its full polygon, so none gains more than that.
        """
        polygons = np.arange(len(self), dtype=np.int32)
        return self.scores(polygons, self.triangles, self.standing, tell) - score(self.standing)

    def areas(self, polygon: int) -> FloatArray:
        """(triangles + 1,) area of a polygon by level; level 0 has none."""
        begin, end = self.offsets[polygon], self.offsets[polygon + 1]
        ring, lowest = self.points[begin:end], self.lowest[begin:end]
        levels = range(1, int(self.triangles[polygon]) + 1)
        return np.array([0.0] + [signed_area(ring[lowest <= level]) for level in levels])


def score(images: Images) -> int:
    """Twice the occlusion measure of the images, summed over the views, in cubic pixels."""
    return int(score_images(images))


def _maps(chains: Sequence[Chain], projections: FloatArray) -> FloatArray:
    """(p, views, 6) plane coordinates to pixels."""
    if not chains:
        return np.empty((0, len(projections), 6))
    # (p, 3, 3): plane coordinates (a, b, 1) to grid space, as columns u, v, depth * d.
    bases = np.stack([chain.plane.axes for chain in chains]).transpose(0, 2, 1).copy()
    bases[:, :, 2] *= np.array([chain.plane.depth for chain in chains])[:, None]
    # One column of all after the other: sums over the last axis, of three numbers, take longest.
    rows = projections[:, :, :3].reshape(-1, 3)
    columns = [
        base[:, :1] * rows[:, 0] + base[:, 1:2] * rows[:, 1] + base[:, 2:] * rows[:, 2]
        for base in np.moveaxis(bases, 2, 0)
    ]
    columns[2] += projections[:, :, 3].ravel()
    return np.stack(columns, axis=2).reshape(len(chains), len(projections), 6)
