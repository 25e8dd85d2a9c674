"""64 x 64 pictures of a sphere from any side, for tests of what searches look at."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import SIZE


def sphere_projections(axes, centre, radius):
    """(views, 2, 4) affine maps that show a sphere with a one-pixel frame; axes (views, 3, 3)."""
    scale = (SIZE - 2) / (2.0 * radius)
    linear = axes[:, :2, :] * scale
    offset = SIZE / 2.0 - linear @ np.asarray(centre)
    return np.ascontiguousarray(np.concatenate([linear, offset[:, :, None]], axis=2))
