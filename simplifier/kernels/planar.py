"""Predicates of the plane that several kernels share."""

from __future__ import annotations

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel

# Things nearer to each other than this share of the largest coordinate count as touching: 1e-9
# voxels on a grid of a hundred.  Rounding stays far below it, real features far above.
TOUCH = 1e-11


@inline_kernel
def cross(ax, ay, bx, by, cx, cy):
    """Twice the signed area of the triangle a, b, c; positive when c lies left of a -> b."""
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@inner_kernel
def magnitude(points):
    """Largest absolute coordinate of (n, 2) points."""
    largest = 0.0
    for index in range(len(points)):
        largest = max(largest, abs(points[index, 0]), abs(points[index, 1]))
    return largest


@inner_kernel
def twice_area(points):
    """Twice the shoelace area of an (n, 2) loop, relative to its first point for accuracy."""
    x, y = points[0]
    total = 0.0
    for index in range(2, len(points)):
        total += cross(
            x, y, points[index - 1, 0], points[index - 1, 1], points[index, 0], points[index, 1]
        )
    return total


@inner_kernel
def is_inside(x, y, loop):
    """Even-odd rule; the point must not lie on the (n, 2) loop."""
    inside = False
    previous_x, previous_y = loop[-1]
    for index in range(len(loop)):
        next_x, next_y = loop[index]
        if (previous_y > y) != (next_y > y):
            t = (y - previous_y) / (next_y - previous_y)
            if x < previous_x + t * (next_x - previous_x):
                inside = not inside
        previous_x, previous_y = next_x, next_y
    return inside
