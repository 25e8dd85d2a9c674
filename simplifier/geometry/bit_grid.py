"""BitGrid: voxels as bits, so that one operation takes 64 of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_WORD = 64


@dataclass(frozen=True, eq=False)
class BitGrid:
    """Which voxels of a grid are set; an eighth of the memory of booleans.

    ``words``  (nx, ny, ceil(nz / 64)) uint64: bit z % 64 of word z // 64 is voxel z.  Bits past the
               last voxel are never set.
    ``depth``  nz.
    """

    words: NDArray[np.uint64]
    depth: int

    @classmethod
    def of(cls, voxels: NDArray[np.bool_]) -> BitGrid:
        """Those of an (nx, ny, nz) bool array."""
        nx, ny, nz = voxels.shape
        octets = np.zeros((nx, ny, -(-nz // _WORD) * 8), dtype=np.uint8)
        octets[:, :, : -(-nz // 8)] = np.packbits(voxels, axis=2, bitorder="little")
        return cls(octets.view("<u8").astype(np.uint64, copy=False), nz)

    @classmethod
    def empty(cls, shape: tuple[int, int, int]) -> BitGrid:
        """A grid of that shape without any."""
        nx, ny, nz = shape
        return cls(np.zeros((nx, ny, -(-nz // _WORD)), dtype=np.uint64), nz)

    @property
    def voxels(self) -> NDArray[np.bool_]:
        """(nx, ny, nz) bool, made anew."""
        octets = self.words.astype("<u8", copy=False).view(np.uint8)
        return np.unpackbits(octets, axis=2, count=self.depth, bitorder="little").view(np.bool_)

    @property
    def shape(self) -> tuple[int, int, int]:
        nx, ny, _ = self.words.shape
        return nx, ny, self.depth

    @property
    def count(self) -> int:
        """Number of voxels that are set."""
        return int(np.bitwise_count(self.words).sum(dtype=np.int64))

    @property
    def places(self) -> NDArray[np.int64]:
        """(n, 3) the voxels that are set, in order; for grids of which few words hold any."""
        x, y, word = np.nonzero(self.words)
        octets = self.words[x, y, word].astype("<u8", copy=False).view(np.uint8)
        which, bit = np.nonzero(np.unpackbits(octets, bitorder="little").reshape(-1, _WORD))
        return np.stack([x[which], y[which], _WORD * word[which] + bit], axis=1)

    @property
    def follow(self) -> NDArray[np.uint64]:
        """Words in which a bit is set where the voxel before it along z is."""
        words = self.words << np.uint64(1)
        words[:, :, 1:] |= self.words[:, :, :-1] >> np.uint64(_WORD - 1)
        return words

    @property
    def precede(self) -> NDArray[np.uint64]:
        """Words in which a bit is set where the voxel after it along z is."""
        words = self.words >> np.uint64(1)
        words[:, :, :-1] |= self.words[:, :, 1:] << np.uint64(_WORD - 1)
        return words

    def __and__(self, other: BitGrid) -> BitGrid:
        return BitGrid(self.words & other.words, self.depth)

    def __or__(self, other: BitGrid) -> BitGrid:
        return BitGrid(self.words | other.words, self.depth)

    def __sub__(self, other: BitGrid) -> BitGrid:
        """Those that are not set in the other grid."""
        return BitGrid(self.words & ~other.words, self.depth)

    def __invert__(self) -> BitGrid:
        free = ~self.words
        if (last := self.depth % _WORD) > 0:
            free[:, :, -1] &= np.uint64((1 << last) - 1)
        return BitGrid(free, self.depth)
