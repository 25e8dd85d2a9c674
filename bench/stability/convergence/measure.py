"""The occlusion measure of a report against directions and pixels.

    directions   even ones over a hemisphere, as the report takes them, turned at random as a whole
                 for each of eight seeds; against the mean of all at the most directions.
    random directions   as many independent ones, to compare.
    image        64 even directions, turned as above, against the same at 1024 pixels.

``original`` is that of the mesh, as a share of the reference; ``ratio`` the occluder's share of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.spatial.transform import Rotation

import simplifier
from bench.stability.convergence.curve import Curve, curves
from bench.stability.convergence.subjects import Subject
from simplifier.accuracy.accuracy import view_masks
from simplifier.accuracy.occlusion import DIRECTIONS, IMAGE
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.views import hemisphere_directions, random_directions
from simplifier.selection.measure import directional_measures

DEFAULT_VALUES = {"directions": DIRECTIONS, "random directions": DIRECTIONS, "image": IMAGE}

_SEEDS = 8
_COUNTS = (8, 16, 32, 64, 128, 256, 512)
_IMAGES, _FINEST = (32, 64, 128, 256, 512), 1024
_BLOCK = 32  # views whose masks are held at once

Sums = dict[int, FloatArray]
"""By value of a knob: (seeds, 2), the mean measures of original and occluder."""


def measure_curves(subject: Subject) -> Iterator[Curve]:
    """Both figures against each knob."""
    occluder = simplifier.simplify(subject.mesh, **subject.options).occluder

    def means(make: Callable[[int], FloatArray], image: int) -> FloatArray:
        return np.stack(
            [mean_measures(subject, occluder, make(seed), image) for seed in range(_SEEDS)]
        )

    def even(count: int) -> Callable[[int], FloatArray]:
        return lambda seed: turned(hemisphere_directions(count), seed)

    def scattered(count: int) -> Callable[[int], FloatArray]:
        return lambda seed: random_directions(count, seed)

    found = {count: means(even(count), IMAGE) for count in _COUNTS}
    every = found[_COUNTS[-1]].mean(axis=0)
    yield from _against(subject.name, "directions", DIRECTIONS, found, every)
    random = {count: means(scattered(count), IMAGE) for count in _COUNTS}
    yield from _against(subject.name, "random directions", DIRECTIONS, random, every)
    images = {image: means(even(DIRECTIONS), image) for image in _IMAGES}
    finest = means(even(DIRECTIONS), _FINEST)
    yield from _against(subject.name, "image", IMAGE, images, finest)


def turned(directions: FloatArray, seed: int) -> FloatArray:
    """The same lattice, turned as a whole by a random rotation."""
    rotation = Rotation.random(random_state=np.random.default_rng(seed))
    return np.asarray(rotation.apply(directions))


def mean_measures(
    subject: Subject, occluder: Occluder, directions: FloatArray, image: int
) -> FloatArray:
    """(2,) of original and occluder, exact, in cubes of the image's side."""
    sums = np.zeros(2)
    for first in range(0, len(directions), _BLOCK):
        masks = view_masks(subject.mesh, occluder, directions[first : first + _BLOCK], image)
        sums += [directional_measures(mask, 1.0 / image).sum() for mask in masks]
    return sums / len(directions)


def _against(mesh: str, knob: str, default: int, found: Sums, reference: FloatArray) -> list[Curve]:
    """``reference`` (2,), or (seeds, 2) where each seed has its own."""
    errors = {
        "original": {
            value: list(sums[:, 0] / reference[..., 0] - 1.0) for value, sums in found.items()
        },
        "ratio": {
            value: list(sums[:, 1] / sums[:, 0] - reference[..., 1] / reference[..., 0])
            for value, sums in found.items()
        },
    }
    return curves(mesh, knob, default, errors)
