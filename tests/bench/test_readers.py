"""What other programs read, held against what was written."""

from __future__ import annotations

import numpy as np
import pytest

from bench.readers import difference
from simplifier.geometry.occluder import Occluder
from simplifier.io.written_faces import quads_and_triangles
from tests.solids import box

CUBE = Occluder(box().vertices, box().faces)
CORNERS = CUBE.vertices[CUBE.faces]
QUADS, _ = quads_and_triangles(CUBE)
NONE = QUADS[:0]


def split_the_other_way():
    halves = np.concatenate([QUADS[:, [1, 2, 3]], QUADS[:, [3, 0, 1]]])
    return CUBE.vertices[halves]


@pytest.mark.parametrize(
    ("corners", "quads", "said"),
    [
        (CORNERS, NONE, "same"),
        (CORNERS[::-1, [1, 2, 0]], NONE, "same"),
        (CORNERS, QUADS, "same"),
        (split_the_other_way(), QUADS, "same"),
        (split_the_other_way(), NONE, "other triangles"),
        (CORNERS[:, ::-1], NONE, "other windings"),
        (CORNERS[1:], NONE, "11 of 12 triangles"),
        (np.concatenate([CORNERS, CORNERS[:1]]), NONE, "13 of 12 triangles"),
        (CORNERS + 1e-3, NONE, "moved"),
        (CORNERS[:0], NONE, "0 of 12 triangles"),
    ],
)
def test_what_a_reader_is_said_to_read(corners, quads, said):
    assert difference(CUBE, quads, corners) == said
