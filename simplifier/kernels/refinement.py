"""Move the vertices of an occluder to raise its occlusion measure inside an allowed solid.

The occluder is ``vertices`` (n, 3) float64 in grid space and ``faces`` (m, 3) int32; the faces at
vertex i are ``incident[begins[i]:begins[i + 1]]``.  Views are 64 x 64 bit images: ``projections``
(V, 2, 4) float64 and the original's silhouettes ``originals`` (V, 64) uint64.  ``images`` (m, V,
64) uint64 holds each triangle's picture, ``blocks`` (b, V, 64) the union of :data:`BLOCK` of them,
``scores`` (V,) int64 what each view scores.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import draw_edge, measure_twice, popcount
from simplifier.kernels.compile import kernel
from simplifier.kernels.voxels import contained

BLOCK = 8
"""Triangles whose union is kept, so that "all but these" costs few images."""

TRIES = 6
"""Moves tried at a vertex before another is drawn; they share the picture of all the rest."""

_STRIDE = 4  # a move is judged on every fourth view first


@kernel
def _draw_triangle(p, q, r, m, image):
    """Draw a projected triangle into rows 1 to 64 of ``image`` (66,), which are cleared first."""
    for row in range(66):
        image[row] = 0
    px = m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3]
    py = m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3]
    qx = m[0, 0] * q[0] + m[0, 1] * q[1] + m[0, 2] * q[2] + m[0, 3]
    qy = m[1, 0] * q[0] + m[1, 1] * q[1] + m[1, 2] * q[2] + m[1, 3]
    rx = m[0, 0] * r[0] + m[0, 1] * r[1] + m[0, 2] * r[2] + m[0, 3]
    ry = m[1, 0] * r[0] + m[1, 1] * r[1] + m[1, 2] * r[2] + m[1, 3]
    draw_edge(px, py, qx, qy, image)
    draw_edge(qx, qy, rx, ry, image)
    draw_edge(rx, ry, px, py, image)


@kernel
def _score(here, there, original, penalty):
    """Twice the measure within the original less ``penalty`` for each pixel outside of it."""
    outside = np.uint64(0)
    for row in range(64):
        outside += popcount(here[row + 1] & ~original[row])
        here[row + 1] &= original[row]
    return measure_twice(here, there) - penalty * np.int64(outside)


@kernel
def _corners(vertices, faces, face, moved, place):
    """The corners of a face, with vertex ``moved`` at ``place``."""
    a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
    p = place if a == moved else (vertices[a, 0], vertices[a, 1], vertices[a, 2])
    q = place if b == moved else (vertices[b, 0], vertices[b, 1], vertices[b, 2])
    r = place if c == moved else (vertices[c, 0], vertices[c, 1], vertices[c, 2])
    return p, q, r


@kernel
def all_contained(vertices, faces, allowed, inside):
    """Write into ``inside`` (m,) bool whether each face keeps to the voxels of ``allowed``."""
    nowhere = (0.0, 0.0, 0.0)
    for face in range(len(faces)):
        p, q, r = _corners(vertices, faces, face, -1, nowhere)
        inside[face] = contained(p, q, r, allowed)


@kernel
def _unite_block(images, block, blocks):
    for view in range(blocks.shape[1]):
        for row in range(64):
            blocks[block, view, row] = 0
    for face in range(block * BLOCK, min((block + 1) * BLOCK, len(images))):
        for view in range(blocks.shape[1]):
            for row in range(64):
                blocks[block, view, row] |= images[face, view, row]


@kernel
def draw_all(vertices, faces, projections, originals, penalty, images, blocks, scores):
    """Fill ``images``, ``blocks`` and ``scores`` of an occluder; return the sum of the scores."""
    here = np.zeros(66, np.uint64)
    there = np.zeros(66, np.uint64)
    nowhere = (0.0, 0.0, 0.0)
    for face in range(len(faces)):
        p, q, r = _corners(vertices, faces, face, -1, nowhere)
        for view in range(len(projections)):
            _draw_triangle(p, q, r, projections[view], here)
            for row in range(64):
                images[face, view, row] = here[row + 1]
    for block in range(len(blocks)):
        _unite_block(images, block, blocks)
    total = np.int64(0)
    for view in range(len(projections)):
        for row in range(64):
            here[row + 1] = 0
            for block in range(len(blocks)):
                here[row + 1] |= blocks[block, view, row]
        scores[view] = _score(here, there, originals[view], penalty)
        total += scores[view]
    return total


@kernel
def _unite_rest(faces, vertex, images, blocks, rest):
    """The union of all triangles that do not have the vertex."""
    for view in range(rest.shape[0]):
        for row in range(64):
            rest[view, row] = 0
    for block in range(len(blocks)):
        first, last = block * BLOCK, min((block + 1) * BLOCK, len(faces))
        split = False
        for face in range(first, last):
            if faces[face, 0] == vertex or faces[face, 1] == vertex or faces[face, 2] == vertex:
                split = True
        if not split:
            for view in range(rest.shape[0]):
                for row in range(64):
                    rest[view, row] |= blocks[block, view, row]
            continue
        for face in range(first, last):
            if faces[face, 0] != vertex and faces[face, 1] != vertex and faces[face, 2] != vertex:
                for view in range(rest.shape[0]):
                    for row in range(64):
                        rest[view, row] |= images[face, view, row]


@kernel
def _try_views(
    vertices, faces, incident, begin, end, vertex, place, projections, originals, penalty,
    rest, first, drawn, scores, trial, here, there,
):  # fmt: skip
    """Score every ``_STRIDE``-th view from ``first`` with the vertex moved; return the change."""
    change = np.int64(0)
    for view in range(first, len(projections), _STRIDE):
        for k in range(end - begin):
            p, q, r = _corners(vertices, faces, incident[begin + k], vertex, place)
            _draw_triangle(p, q, r, projections[view], there)
            for row in range(64):
                drawn[k, view, row] = there[row + 1]
        for row in range(64):
            here[row + 1] = rest[view, row]
        for k in range(end - begin):
            for row in range(64):
                here[row + 1] |= drawn[k, view, row]
        trial[view] = _score(here, there, originals[view], penalty)
        change += trial[view] - scores[view]
    return change


@kernel
def _accept(incident, begin, end, drawn, trial, images, blocks, scores):
    for k in range(end - begin):
        face = incident[begin + k]
        for view in range(images.shape[1]):
            for row in range(64):
                images[face, view, row] = drawn[k, view, row]
        _unite_block(images, face // BLOCK, blocks)
    for view in range(len(scores)):
        scores[view] = trial[view]


@kernel
def _random(state):
    """The next state of a 64-bit xorshift generator."""
    x = state
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    return x


@kernel
def _unit(state):
    """A number in [0, 1) from a state."""
    return float(state >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def move_vertices(
    vertices, faces, begins, incident, projections, originals, allowed, penalty,
    images, blocks, scores, best, best_score, state, moves, shares, steps, heats,
):  # fmt: skip
    """Try so many ``moves``, while the share of the search that is done goes through ``shares``.

    A vertex moves by up to a step a coordinate; a move that gains is tried again in the same
    direction.  A move is taken when every triangle keeps to ``allowed`` (nx, ny, nz) bool and the
    score rises, or falls by no more than chance allows (simulated annealing).  ``steps`` (voxels)
    and ``heats`` (score) are the values at share 0 and share 1, geometric in between; ``shares``
    (two floats) are those at the first move and after the last.

    ``vertices``, ``images``, ``blocks`` and ``scores`` are the current state, ``best`` (n, 3) the
    best vertices yet, ``best_score`` (1,) int64 their score, ``state`` (1,) uint64 the generator.
    Returns the current score.
    """
    views = len(projections)
    here = np.zeros(66, np.uint64)
    there = np.zeros(66, np.uint64)
    rest = np.zeros((views, 64), np.uint64)
    trial = np.zeros(views, np.int64)
    most = 0
    for i in range(len(begins) - 1):
        most = max(most, begins[i + 1] - begins[i])
    drawn = np.zeros((most, views, 64), np.uint64)
    random = state[0]
    total = np.sum(scores)
    vertex, begin, end = 0, 0, 0
    dx, dy, dz = 0.0, 0.0, 0.0
    again = False
    for move in range(moves):
        share = shares[0] + (shares[1] - shares[0]) * move / moves
        if move % TRIES == 0:
            random = _random(random)
            vertex = np.int64(random >> np.uint64(20)) % len(vertices)
            begin, end = begins[vertex], begins[vertex + 1]
            _unite_rest(faces, vertex, images, blocks, rest)
            again = False
        if not again:
            step = 2.0 * steps[0] * (steps[1] / steps[0]) ** share
            random = _random(random)
            dx = (_unit(random) - 0.5) * step
            random = _random(random)
            dy = (_unit(random) - 0.5) * step
            random = _random(random)
            dz = (_unit(random) - 0.5) * step
        again = False
        place = (vertices[vertex, 0] + dx, vertices[vertex, 1] + dy, vertices[vertex, 2] + dz)
        if not contained(place, place, place, allowed):
            continue
        random = _random(random)
        least = heats[0] * (heats[1] / heats[0]) ** share * np.log(_unit(random) + 1e-300)
        change = np.int64(0)
        promising = True
        for phase in range(_STRIDE):
            change += _try_views(
                vertices, faces, incident, begin, end, vertex, place, projections, originals,
                penalty, rest, phase, drawn, scores, trial, here, there,
            )  # fmt: skip
            if phase > 0:
                continue
            # A quarter of the views that loses this much is hardly made good by the others.  It is
            # cheaper than the exact test of large triangles in fine grids, which so comes after it.
            promising = 2 * change >= least
            for i in range(begin, end):
                p, q, r = _corners(vertices, faces, incident[i], vertex, place)
                promising = promising and contained(p, q, r, allowed)
            if not promising:
                break
        if not promising or change < least:
            continue
        _accept(incident, begin, end, drawn, trial, images, blocks, scores)
        total += change
        vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2] = place
        again = change > 0
        if total > best_score[0]:
            best_score[0] = total
            for i in range(len(vertices)):
                for k in range(3):
                    best[i, k] = vertices[i, k]
    state[0] = random
    return total
