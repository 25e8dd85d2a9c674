"""Sight + cells -> what is seen from them, by a pool.

What sees is sent as it is, its arrays apart from the rest, so that all processes of a machine read
the same ones.  A run pickles it for workers, which run its code in any case; what they answer is
read as packed bits and bytes.
"""

from __future__ import annotations

import json
import pickle
from collections.abc import Generator, Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import MeshError
from simplifier.pools import Arrived, Pool, PoolJob, Shared, Work
from simplifier.progress import Cancel
from simplifier.visibility.known import Known, known_of
from simplifier.visibility.method import See

_AXES = 3


def look_from(
    see: See, objects: int, parts: Sequence[NDArray[np.int64]], pool: Pool, cancel: Cancel
) -> Generator[tuple[NDArray[np.int64], list[Known] | str], None, None]:
    """Some of the ``parts`` of cells, and what is known of each or why nothing is; in any order.

    ``see``  of a portable sight over so many ``objects``.
    """
    jobs = [PoolJob(json.dumps(part.tolist()).encode()) for part in parts]
    work = f"{__name__}:{start_looking.__name__}"
    for outcome in pool.run_jobs(work, _sent(see), jobs, cancel):
        part, answer = parts[outcome.job], outcome.answer
        if answer.failure:
            yield part, answer.failure
            continue
        try:
            yield part, _unpacked(answer.result, len(part), objects)
        except MeshError as error:
            yield part, str(error)


def _sent(see: See) -> Shared:
    buffers: list[pickle.PickleBuffer] = []
    settings = pickle.dumps(see, protocol=5, buffer_callback=buffers.append)
    arrays = {f"{place:05}": [np.frombuffer(one.raw(), np.uint8)]
              for place, one in enumerate(buffers)}  # fmt: skip
    return Shared(settings, arrays)


def start_looking(arrived: Arrived) -> Work:
    """What a worker of a pool does with a job."""
    buffers = [arrived.arrays[name] for name in sorted(arrived.arrays)]
    see: See = pickle.loads(arrived.settings, buffers=buffers)

    def look(data: bytes) -> bytes:
        return _packed(known_of(see(np.array(json.loads(data), dtype=np.int64))))

    return look


def _packed(known: Sequence[Known]) -> bytes:
    """Whether there are slices; a row of bits a cell; and the slices of what is visible."""
    bits = np.packbits([one.visible for one in known], axis=1)
    sliced = [one.slices for one in known if one.slices is not None]
    return bytes([bool(sliced)]) + bits.tobytes() + b"".join(one.tobytes() for one in sliced)


def _unpacked(answer: bytes, cells: int, objects: int) -> list[Known]:
    """Raises :class:`MeshError` for what no worker of this release says."""
    width = -(-objects // 8)
    bits = np.frombuffer(answer[1 : 1 + cells * width], np.uint8)
    rest = np.frombuffer(answer[1 + cells * width :], np.int8)
    sliced = answer[:1] == b"\x01"
    if len(bits) == cells * width:
        visible = np.unpackbits(bits.reshape(cells, width), axis=1, count=objects).astype(np.bool_)
        counts = visible.sum(axis=1)
        if len(rest) == _AXES * int(counts.sum()) * sliced:
            ends = np.cumsum(counts)[:-1]
            slices = np.split(rest.reshape(-1, _AXES), ends) if sliced else [None] * cells
            return [Known(row, some, None) for row, some in zip(visible, slices, strict=True)]
    raise MeshError("what a worker saw arrived damaged", remedy="run it again")
