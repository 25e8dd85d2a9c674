"""Threads that store, name, read and forget the same few blobs all the time, while others sweep."""

from __future__ import annotations

import io
import random
import threading
import time
from collections import Counter
from collections.abc import Callable, Collection, Sequence

from service.jobs.job import Blob
from service.jobs.stores import BlobStore
from tests.service.storage.blobs.blob_store_contract import blob_of

_SECONDS = 60.0
_ROUNDS = (1, 4, 16, 64)


class Rows:
    """As a database: what was committed is seen, by each from then on.

    ``commit_by``  what has to be done within the transaction that names a blob.
    """

    def __init__(self, commit_by: Callable[[Blob], None] = lambda blob: None) -> None:
        self._commit_by = commit_by
        self.lock = threading.Lock()
        self.names: Counter[str] = Counter()
        self.told = 0

    def commit(self, blob: Blob) -> None:
        self._commit_by(blob)
        with self.lock:
            self.names[blob.digest] += 1

    def forget(self, digest: str) -> None:
        with self.lock:
            self.names[digest] -= 1

    def unnamed(self, digests: Collection[str]) -> set[str]:
        with self.lock:
            unnamed = set(digests).difference(+self.names)
            self.told += len(unnamed)
            return unnamed


def race(
    stores: Sequence[BlobStore],
    rows: Rows,
    contents: Sequence[bytes],
    sweep: Callable[[], int],
    least: int,
) -> None:
    """Until sweeps have removed as many blobs, and have spared twice as many that no row named at
    that moment; fails where one took what a row names.

    A sweep spares what somebody has touched since it began.  So after some rounds, few or many,
    each thread waits for a sweep to end: else those of a fast machine touch all during each.
    """
    faults: list[BaseException] = []
    stop = threading.Event()
    swept = threading.Condition()

    def work(seed: int) -> None:
        chance = random.Random(seed)
        rounds = 0
        while not stop.is_set():
            if rounds == 0:
                with swept:
                    if not stop.is_set():
                        swept.wait()
                rounds = chance.choice(_ROUNDS)
            rounds -= 1
            data, store = chance.choice(contents), chance.choice(stores)
            blob = blob_of(data)
            try:
                with store.keeping() as keeping:
                    try:
                        keeping.adopt(blob)
                    except KeyError:
                        keeping.put(io.BytesIO(data))
                    rows.commit(blob)
                with store.open(blob) as file:
                    assert file.read() == data
                rows.forget(blob.digest)
            except BaseException as error:
                faults.append(error)
                raise

    removed = 0
    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(3)]
    for thread in threads:
        thread.start()
    deadline = time.monotonic() + _SECONDS
    try:
        while not faults and time.monotonic() < deadline:
            removed += sweep()
            if removed >= least and rows.told - removed >= 2 * least:
                break
            with swept:
                swept.notify_all()
    finally:
        with swept:
            stop.set()
            swept.notify_all()
        for thread in threads:
            thread.join()
    assert faults == []
    assert removed >= least  # else nothing was put to the test
    assert rows.told - removed >= 2 * least
