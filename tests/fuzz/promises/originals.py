"""A glTF file that an occluder is added to: refused, or all of it is still there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import numpy as np

from simplifier.geometry.occluder import Occluder
from simplifier.io.glb_embed import embed_occluder
from simplifier.io.gltf import BEFORE
from simplifier.io.load import load
from simplifier.options.simplify import Embedding
from tests.fuzz.promises import promise
from tests.solids import box

_ADDED = Occluder(box().vertices, box().faces, 0.5)


def check_original(data: bytes, folder: Path) -> None:
    """Raises ``OccluderError`` for a file that is refused."""
    path = folder / "original.glb"
    path.write_bytes(data)
    mesh = load(path)
    believed = BEFORE.encode() in data  # an earlier run, which says what it added
    both = folder / "both" / path.name  # nodes are named after the file
    both.parent.mkdir(exist_ok=True)
    for how in get_args(Embedding):
        both.write_bytes(embed_occluder(path, mesh, _ADDED, how))
        if believed:
            continue
        again = load(both)
        promise(
            np.array_equal(again.vertices, mesh.vertices)
            and np.array_equal(again.faces, mesh.faces),
            f"the original is the same with an occluder ({how})",
        )
        second = embed_occluder(both, again, _ADDED, how)
        promise(
            _parts(second) == _parts(both.read_bytes()),
            "a second occluder takes the place of the first",
        )


def _parts(glb: bytes) -> tuple[object, bytes]:
    """The JSON, whose keys may stand in any order, and the rest."""
    end = 20 + int.from_bytes(glb[12:16], "little")
    return json.loads(glb[20:end]), glb[end:]
