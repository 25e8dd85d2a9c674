"""A small file of visible sets, and each way in which one can be wrong.

Both readers, the library's and the C header's, are held to them.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from simplifier.geometry.pvs import NEVER, UNKNOWN, Altitudes, Pvs, Slices, pack_rows
from simplifier.geometry.view_cells import ViewCells

HEADER = 144
BLOCKS = {
    name: 88 + 4 * place
    for place, name in enumerate(
        ("order", "cells", "grid", "row_of", "row_offsets", "rows", "slices", "altitudes", "names")
    )
}
"""Where the header says where each block begins."""


SLICES = np.array([[3, 0, 0], [0, -2, 5], [-1, 0, 3], [0, 0, 0], [8, -7, 8]], np.int8)
ALTITUDES = np.array(
    [[NEVER, NEVER, 0, 2], [NEVER, 1, 2, NEVER], [0, 0, 0, 0], [0, NEVER, NEVER, NEVER]], np.uint16
)


def town(**changes):
    """Two boxes, a prism and a cell that is not computed; four objects, in parts and by altitude.

    From half up all of a cell's set is seen.
    """
    cells = ViewCells.joined(
        ViewCells.boxes(
            np.array([[0.0, 0, 0], [1, 0, 0], [8, 8, 0]]),
            np.array([[2.0, 2, 2], [3, 2, 2], [9, 9, 1]]),
        ),
        ViewCells.prisms(np.array([[[4.0, 0], [4, 4], [6, 0]]]), np.zeros(1), np.full(1, 3.0)),
    )
    sets = [np.array(each, bool) for each in ([1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 0, 1])]
    rows, places = pack_rows(sets)
    members = {
        "up": "y", "origin": np.array([5e6, 2e6, 100.0]), "names": ("a", "b", "Häuser", "Häfen"),
        "order": np.array([3, 2, 1, 0], np.int32), "cells": cells, "rows": rows,
        "row_of": np.array([places[0], places[1], UNKNOWN, places[2]]), "method": "slice-wise",
        "conservative": True, "scene": b"town\0\0\0\0", "settings": bytes(range(8)),
        "slices": Slices(np.array([0, 2, 4, 4, 5]), SLICES),
        "altitudes": Altitudes(0.0, 0.25, ALTITUDES),
    }  # fmt: skip
    return Pvs(**{**members, **changes})


def signed(data):
    """With the checksum of what the bytes now are."""
    whole = bytearray(data)
    whole[140:144] = bytes(4)
    whole[140:144] = struct.pack("<I", zlib.crc32(whole))
    return bytes(whole)


def patched(data, offset, patch):
    return signed(data[:offset] + patch + data[offset + len(patch) :])


def block(data, name):
    """Where a block begins."""
    return 16 * struct.unpack_from("<I", data, BLOCKS[name])[0]


DAMAGES = {
    "another version": (lambda d: 8, struct.pack("<I", 4), "version 4 .* newer release"),
    "an old version": (lambda d: 8, struct.pack("<I", 1), "version 1 .* find the sets again"),
    "a flag of later": (lambda d: 12, struct.pack("<I", 1 | 8 | 16), "not known; .* newer release"),
    "parts in an old version": (lambda d: 8, struct.pack("<I", 2), "not known; .* newer release"),
    "blocks in an old version": (
        lambda d: 8, struct.pack("<II", 2, 1 | 8 | 1 << 8), "not known; .* newer release",
    ),
    "no flag of slices": (lambda d: 12, struct.pack("<I", 1 | 4 | 8 | 1 << 8), "truly .* slices"),
    "no altitudes": (lambda d: BLOCKS["altitudes"], struct.pack("<I", 0), "truly .* altitudes"),
    "no up axis": (lambda d: 12, struct.pack("<I", 15 | 3 << 8), "up axis"),
    "all computed": (lambda d: 12, struct.pack("<I", 7), "not say truly"),
    "a longer file": (lambda d: 16, struct.pack("<Q", 1 << 40), "should have 1099511627776 bytes"),
    "many objects": (lambda d: 24, struct.pack("<I", 2**32 - 1), "claims 4294967295 objects"),
    "more objects": (lambda d: 24, struct.pack("<I", 2**31 - 1), "not in the file"),
    "fewer objects": (lambda d: 24, struct.pack("<I", 3), "each once"),
    "many cells": (lambda d: 28, struct.pack("<I", 2**32 - 1), "cells, .* not in the file"),
    "many rows": (lambda d: 32, struct.pack("<I", 2**32 - 1), "row_offsets, .* not in the file"),
    "no such method": (lambda d: 36, struct.pack("<I", 4), "method is number 4 of 4"),
    "an origin of NaN": (lambda d: 48, struct.pack("<d", np.nan), "origin is not finite"),
    "another box": (lambda d: 64, struct.pack("<f", 0.5), "box of all its view cells"),
    "a block in the header": (lambda d: BLOCKS["rows"], struct.pack("<I", 8), "not in the file"),
    "a block behind the end": (lambda d: BLOCKS["grid"], struct.pack("<I", 2**32 - 1), "not in"),
    "an object twice": (lambda d: block(d, "order"), struct.pack("<I", 2), "each once"),
    "no such object": (lambda d: block(d, "order"), struct.pack("<I", 4), "each once"),
    "half a box": (lambda d: block(d, "cells") + 16, struct.pack("<f", 0.0), "not finite"),
    "an infinite cell": (lambda d: block(d, "cells") + 8, struct.pack("<f", np.inf), "not finite"),
    "a flat cell": (lambda d: block(d, "cells") + 28, struct.pack("<f", 0.0), "cell 0 holds"),
    "a turned box": (lambda d: block(d, "cells") + 8, struct.pack("<f", -1.0), "cell 0 holds"),
    "a clockwise prism": (
        lambda d: block(d, "cells") + 96, struct.pack("<6f", 4, 0, 4, 4, 6, 0), "clockwise",
    ),
    "a tile of no size": (lambda d: block(d, "grid") + 8, struct.pack("<f", 0.0), "no tiles"),
    "no tiles": (lambda d: block(d, "grid") + 12, struct.pack("<I", 0), "no tiles"),
    "many tiles": (lambda d: block(d, "grid") + 12, struct.pack("<II", *2 * [2**32 - 1]), "grid"),
    "a tile that begins late": (lambda d: block(d, "grid") + 32, struct.pack("<I", 1), "ascend"),
    "no such cell": (
        lambda d: block(d, "row_of") - 16, struct.pack("<4I", *4 * [9]), "names cell 9",
    ),
    "no such row": (lambda d: block(d, "row_of"), struct.pack("<I", 3), "names row 3"),
    "rows that fall": (lambda d: block(d, "row_offsets") + 4, struct.pack("<I", 5), "not ascend"),
    "rows behind the end": (
        lambda d: block(d, "row_offsets") + 12, struct.pack("<I", 2**32 - 1), "not in the file",
    ),
    "a run that goes on": (lambda d: block(d, "rows") + 1, b"\x82", "goes on"),
    "a run beyond the objects": (lambda d: block(d, "rows") + 1, b"\x05", "longer than the 4"),
    "runs beyond the objects": (lambda d: block(d, "rows"), b"\x03\x02", "longer than the 4"),
    "an empty run": (lambda d: block(d, "rows") + 1, b"\x00", "run is empty"),
    "no slices": (lambda d: block(d, "slices"), struct.pack("<I", 0), "a slice is none of 0"),
    "many slices": (lambda d: block(d, "slices"), struct.pack("<I", 128), "is none of 128"),
    "fewer slices": (lambda d: block(d, "slices"), struct.pack("<I", 7), "is none of 7"),
    "slices that fall": (
        lambda d: block(d, "slices") + 20, struct.pack("<I", 5), "slices do not ascend",
    ),
    "slices behind the end": (
        lambda d: block(d, "slices") + 32, struct.pack("<I", 2**32 - 1), "not in the file",
    ),
    "slices of another cell": (
        lambda d: block(d, "slices") + 20, struct.pack("<I", 1),
        "slices of 1 objects in cell 0, which sees 2",
    ),
    "slices of a cell that is not computed": (
        lambda d: block(d, "slices") + 28, struct.pack("<I", 5), "of 1 objects in cell 2",
    ),
    "nothing left of an object": (lambda d: block(d, "slices") + 36, b"\xf8", "none of 8"),
    "nothing left along y": (lambda d: block(d, "slices") + 37, b"\xf8", "none of 8"),
    "no such slice": (lambda d: block(d, "slices") + 37, b"\x09", "none of 8"),
    "a height from above": (lambda d: block(d, "slices") + 38, b"\xff", "none of 8"),
    "slices that are not there": (
        lambda d: BLOCKS["slices"], struct.pack("<I", 2**32 - 1), "not in the file",
    ),
    "altitudes of NaN": (
        lambda d: block(d, "altitudes"), struct.pack("<f", np.nan), "altitudes begin at nan",
    ),
    "altitudes of no step": (
        lambda d: block(d, "altitudes") + 4, struct.pack("<f", 0.0), "steps of 0.0",
    ),
    "altitudes of endless steps": (
        lambda d: block(d, "altitudes") + 4, struct.pack("<f", np.inf), "steps of inf",
    ),
    "altitudes behind the end": (
        lambda d: BLOCKS["altitudes"], struct.pack("<I", 2**32 - 1), "altitudes, .* not in the",
    ),
    "names that begin late": (lambda d: block(d, "names"), struct.pack("<I", 1), "not ascend"),
    "names behind the end": (lambda d: block(d, "names") + 4, struct.pack("<I", 99), "not in the"),
    "a name that is no text": (lambda d: block(d, "names") + 10, b"\xff", "UTF-8"),
    "a name that shares half a letter": (
        lambda d: block(d, "names") + 23, b"\x02", "begins with half a letter",
    ),
    "a name that adds half a letter": (lambda d: block(d, "names") + 26, b"\xc3", "UTF-8"),
    "a name that shares too much": (
        lambda d: block(d, "names") + 23, b"\x08", "begins with 8 bytes of one of 7",
    ),
    "a first name that shares": (
        lambda d: block(d, "names") + 8, b"\x01", "begins with 1 bytes of one of 0",
    ),
    "a name that is too long": (lambda d: block(d, "names") + 24, b"\x04", "ends behind"),
    "a name too few": (lambda d: block(d, "names") + 24, b"\x02", "goes on behind"),
    "a name too many": (lambda d: block(d, "names") + 4, struct.pack("<I", 15), "goes on"),
    "a length that goes on": (lambda d: block(d, "names") + 23, 5 * b"\x80", "goes on"),
}  # fmt: skip
