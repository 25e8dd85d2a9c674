"""Small scenes of boxes that are built against methods of visibility, and what one sees in them.

All of them have z up, stand on the ground at z = 0, and are looked at from one cell: metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.visibility_city import generated_city, scene_of_boxes
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells


@dataclass(frozen=True)
class Puzzle:
    """A scene and its view cell.

    ``seen``    names of objects of which the cell sees something.
    ``hidden``  names of objects of which it sees nothing; of those in neither set the test does
                not care.
    """

    scene: Scene
    cells: ViewCells
    seen: frozenset[str]
    hidden: frozenset[str]


def street_cell(eye=2.0):
    """A cell of 10 x 10 around the origin."""
    return ViewCells.boxes(np.array([[-5.0, -5.0, 0.0]]), np.array([[5.0, 5.0, eye]]))


def puzzle(boxes, seen=(), hidden=(), eye=2.0):
    """``boxes``: by name the ranges of x and y, and the height."""
    corners = [[(x0, y0, 0.0), (x1, y1, top)] for (x0, x1), (y0, y1), top in boxes.values()]
    scene = scene_of_boxes(np.array(corners, dtype=np.float64), list(boxes))
    return Puzzle(scene, street_cell(eye), frozenset(seen), frozenset(hidden))


def one_box():
    return puzzle({"box": ((20.0, 30.0), (-5.0, 5.0), 10.0)}, seen=["box"])


def wall_with_a_gap(width=2.0, thickness=0.5):
    """One house stands straight behind the gap, one so far aside that no line reaches it."""
    boxes = {
        "wall right": ((20.0, 20.0 + thickness), (-300.0, -0.5 * width), 30.0),
        "wall left": ((20.0, 20.0 + thickness), (0.5 * width, 300.0), 30.0),
        "behind": ((60.0, 70.0), (-3.0, 3.0), 20.0),
        "aside": ((60.0, 70.0), (100.0, 110.0), 20.0),
    }
    return puzzle(boxes, seen=["wall right", "wall left", "behind"], hidden=["aside"])


def fence(name, x, middles, width, thickness=0.5, reach=200.0, top=30.0):
    """Boxes between slits around ``middles``, by name."""
    ends = [-reach, *(y + side * 0.5 * width for y in middles for side in (-1.0, 1.0)), reach]
    return {
        f"{name} {index}": ((x, x + thickness), (ends[2 * index], ends[2 * index + 1]), top)
        for index in range(len(middles) + 1)
    }


def rows_of_slits(width=0.4, pitch=3.0):
    """Two rows of slits, the second shifted by half of the pitch: one sees through aslant alone."""
    middles = np.arange(-60.0, 60.0 + pitch, pitch)
    boxes = {
        **fence("first", 20.0, middles, width),
        **fence("second", 30.0, middles[:-1] + 0.5 * pitch, width),
        "behind": ((60.0, 62.0), (-40.0, 40.0), 20.0),
    }
    # Out at the ends of the first row the slits are too deep for what one sees of them aslant.
    return puzzle(boxes, seen=["first 20", "first 21", "behind"])


def narrow_gaps(width=0.5, thickness=0.2):
    """Gaps of half a pixel, each at another place within its pixel, and a post behind each."""
    middles = np.array([-11.13, -7.25, -3.5, 0.37, 4.62, 8.81, 12.04])
    posts = {
        f"post {index}": ((80.0, 81.0), (4.0 * y - 1.0, 4.0 * y + 1.0), 20.0)
        for index, y in enumerate(middles)
    }
    seen = [f"post {index}" for index in range(len(middles))]
    return puzzle({**fence("wall", 20.0, middles, width, thickness), **posts}, seen=seen)


def steps():
    """Stairs that rise away from the cell, whole in view, and stairs that fall away, hidden."""
    up = {f"up {i}": ((20.0 + 10 * i, 30.0 + 10 * i), (-5.0, 5.0), 3.0 + 3 * i) for i in range(4)}
    down = {
        f"down {i}": ((-30.0 - 10 * i, -20.0 - 10 * i), (-20.0 + 2 * i, 20.0 - 2 * i), 12.0 - 3 * i)
        for i in range(4)
    }
    return puzzle({**up, **down}, [*up, "down 0"], [f"down {i}" for i in (1, 2, 3)])


def two_penumbrae():
    """Figure 2 c: neither box hides the house by itself from all of the cell, but both do."""
    boxes = {
        "right": ((20.0, 22.0), (-30.0, 1.0), 30.0),
        "left": ((30.0, 32.0), (0.0, 40.0), 30.0),
        "house": ((60.0, 62.0), (-1.0, 1.0), 10.0),
    }
    return puzzle(boxes, ["right", "left"], ["house"])


def roof_over_roof():
    """Over a low building one sees a high one, but not the shed between them."""
    boxes = {
        "low": ((20.0, 30.0), (-50.0, 50.0), 5.0),
        "shed": ((32.0, 36.0), (-5.0, 5.0), 3.0),
        "high": ((40.0, 50.0), (-10.0, 10.0), 20.0),
    }
    return puzzle(boxes, ["low", "high"], ["shed"])


def roof_from_above():
    """From 30 m one sees a roof up to its far edge, and past it no more than what is far away."""
    boxes = {
        "house": ((20.0, 30.0), (-50.0, 50.0), 11.0),
        "curb": ((30.5, 31.0), (-5.0, 5.0), 1.0),
        "far": ((70.0, 72.0), (-5.0, 5.0), 1.0),
    }
    return puzzle(boxes, ["house", "far"], ["curb"], eye=30.0)


def city_on_a_slab(blocks=4, seed=3):
    """The scene from which box cells culled nothing, and prisms little: all cells touch the slab,
    and it is in all pixels of the walls between houses.
    """
    city = generated_city(blocks, seed=seed)
    bounds = city.bounds()
    slab = [bounds[:, 0].min(axis=0) - [20.0, 20.0, 1.0], bounds[:, 1].max(axis=0) + 20.0]
    slab[1][2] = 0.0
    return city, scene_of_boxes(np.concatenate([bounds, [slab]]), [*city.names, "slab"])


def city_on_terrain(blocks=4, seed=3):
    """The same over an open sheet that rises and falls by less than a house is deep."""
    city = generated_city(blocks, seed=seed)
    bounds = city.bounds()
    low, high = bounds[:, 0].min(axis=0) - 20.0, bounds[:, 1].max(axis=0) + 20.0
    x, y = (axis.ravel() for axis in np.meshgrid(*np.linspace(low[:2], high[:2], 9).T))
    points = np.column_stack([x, y, 0.5 + 0.5 * np.sin(x) * np.cos(y)])
    corner = (9 * np.arange(8)[:, None] + np.arange(8)).ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, 10], corner[:, None] + [0, 10, 9]])
    sheet = TriangleMesh.from_soup(points, faces)
    return city, Scene(
        (*city.meshes, sheet), (*city.names, "terrain"),
        np.append(city.mesh_of, np.int32(len(city.meshes))).astype(np.int32),
        np.concatenate([city.transforms, np.eye(4)[None]]),
    )  # fmt: skip


PUZZLES = (
    one_box, wall_with_a_gap, rows_of_slits, narrow_gaps, steps, two_penumbrae, roof_over_roof,
    roof_from_above,
)  # fmt: skip
