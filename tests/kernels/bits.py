"""Bit images as (64, 64) bool masks and back, and the shapes that the measure is tested on."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

SIDE = 64

CROSS = ndimage.generate_binary_structure(2, 1)
SQUARE = ndimage.generate_binary_structure(2, 2)
ERODERS = (CROSS, SQUARE, CROSS, SQUARE, CROSS)


def packed(mask):
    """(64,) uint64 of a (64, 64) bool mask: bit c of word r is column c of row r."""
    pixels = np.ascontiguousarray(mask, dtype=np.bool_)
    octets = np.packbits(pixels, axis=1, bitorder="little")
    return octets.view("<u8").astype(np.uint64).reshape(SIDE)


def unpacked(image):
    """(64, 64) bool mask of a (64,) uint64 bit image."""
    octets = np.ascontiguousarray(image).astype("<u8").view(np.uint8).reshape(SIDE, 8)
    return np.unpackbits(octets, axis=1, bitorder="little").astype(np.bool_)


def centres(side=SIDE):
    """x and y of the pixel centres, (side, side) each, 0 in the middle of the image."""
    line = np.arange(side) + 0.5 - side / 2
    return np.meshgrid(line, line)


def disc(radius, side=SIDE):
    x, y = centres(side)
    return x**2 + y**2 < radius**2


def annulus(inner, outer, side=SIDE):
    return disc(outer, side) & ~disc(inner, side)


def rectangle(width, height, side=SIDE):
    mask = np.zeros((side, side), dtype=np.bool_)
    mask[:height, :width] = True
    return np.roll(mask, ((side - height) // 2, (side - width) // 2), (0, 1))


def blob(seed, share=0.3, smooth=5.0, side=SIDE):
    """What a smooth random field exceeds, ``share`` of the image: islands, bays and holes."""
    noise = np.random.default_rng(seed).standard_normal((side, side))
    field = ndimage.gaussian_filter(noise, smooth, mode="constant")
    return field > np.quantile(field, 1.0 - share)


def eroded_areas(mask):
    """Twice the measure by the definition: areas after each erosion, the first counted half."""
    left, total, step = np.asarray(mask), int(mask.sum()), 0
    while left.any():
        left = ndimage.binary_erosion(left, ERODERS[step % len(ERODERS)])
        total += 2 * int(left.sum())
        step += 1
    return total
