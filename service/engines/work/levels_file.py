"""Levels of detail to the last bit, as arrays of NumPy: what all formats can be written from later.

A GLB would not do: it keeps corners as 32-bit numbers, and others keep 64.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import simplifier

Arrays = dict[str, NDArray[Any]]


def save_levels(made: simplifier.SimplifyResult, path: Path) -> None:
    """Write the levels, or the single occluder; the same ones give the same bytes."""
    chain = made.chain
    occluders = [made.occluder] if chain is None else [one.occluder for one in chain.levels]
    arrays: Arrays = {"error_bounds": np.array([one.error_bound for one in occluders])}
    for number, one in enumerate(occluders):
        arrays[f"vertices{number}"], arrays[f"faces{number}"] = one.vertices, one.faces
    if chain is not None:
        arrays["resolutions"] = np.array([one.resolution for one in chain.levels])
        arrays["deviations"] = np.array([one.deviation for one in chain.levels])
        arrays["screen"] = np.array([chain.lens.rows, chain.lens.fov, chain.pixel_error])
    np.savez_compressed(path, allow_pickle=False, **arrays)


def load_levels(path: Path) -> simplifier.LodChain | simplifier.Occluder:
    """What :func:`save_levels` has written."""
    with np.load(path, allow_pickle=False) as arrays:
        bounds = arrays["error_bounds"].tolist()
        occluders = [
            simplifier.Occluder(arrays[f"vertices{number}"], arrays[f"faces{number}"], bound)
            for number, bound in enumerate(bounds)
        ]
        if "screen" not in arrays:
            return occluders[0]
        figures = zip(arrays["resolutions"].tolist(), arrays["deviations"].tolist(), strict=True)
        rows, fov, pixel_error = arrays["screen"].tolist()
    levels = tuple(
        simplifier.Level(one, resolution, deviation)
        for one, (resolution, deviation) in zip(occluders, figures, strict=True)
    )
    return simplifier.LodChain(levels, simplifier.Lens(int(rows), fov), pixel_error)
