"""Blobs while others sweep, and when the process is killed: by threads and by real kills."""

from __future__ import annotations

import hashlib
import io
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Collection

from service.jobs.job import Blob
from service.storage.blobs.file_blobs import FileBlobs
from tests.service.storage.blobs.blob_store_contract import blob_of


class Rows:
    """As a database: what was committed is seen, by each from then on."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.names: Counter[str] = Counter()

    def commit(self, digest: str) -> None:
        with self.lock:
            self.names[digest] += 1

    def forget(self, digest: str) -> None:
        with self.lock:
            self.names[digest] -= 1

    def unnamed(self, digests: Collection[str]) -> set[str]:
        with self.lock:
            return set(digests).difference(+self.names)


def test_no_sweep_takes_what_a_row_names(tmp_path):
    """Few contents and many threads, so that all meet at the same blobs all the time."""
    store, rows, faults = FileBlobs(tmp_path), Rows(), []
    stop = threading.Event()
    contents = [bytes([i]) * 100 for i in range(12)]

    def work(seed: int) -> None:
        chance = random.Random(seed)
        while not stop.is_set():
            data = chance.choice(contents)
            blob = blob_of(data)
            try:
                with store.keeping() as keeping:
                    try:
                        keeping.adopt(blob)
                    except KeyError:
                        keeping.put(io.BytesIO(data))
                    rows.commit(blob.digest)
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
    deadline = time.monotonic() + 20.0
    while removed < 120 and not faults and time.monotonic() < deadline:
        removed += store.sweep(rows.unnamed)
    stop.set()
    for thread in threads:
        thread.join()
    assert faults == []
    assert removed >= 120  # else nothing was put to the test
    store.sweep(rows.unnamed)
    assert list(store.digests()) == []
    assert list((tmp_path / "drafts").iterdir()) == []


PUTS = """
import io, random, sys
from pathlib import Path
from service.storage.blobs.file_blobs import FileBlobs
store, chance = FileBlobs(Path(sys.argv[1])), random.Random(int(sys.argv[2]))
while True:
    with store.keeping() as keeping:
        blob = keeping.put(io.BytesIO(chance.randbytes(chance.choice([10, 10_000, 3_000_000]))))
        print(blob.digest, blob.size, flush=True)
"""


def test_a_kill_leaves_whole_blobs_only(tmp_path):
    chance = random.Random(1)
    for seed in range(6):
        command = [sys.executable, "-c", PUTS, str(tmp_path), str(seed)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        lines = [process.stdout.readline() for _ in range(chance.randrange(1, 30))]
        process.kill()
        lines += process.stdout.read().splitlines()
        process.wait()
        store = FileBlobs(tmp_path)
        for line in lines:
            digest, size = line.split()
            with store.open(Blob(digest, int(size))) as file:
                assert hashlib.sha256(file.read()).hexdigest() == digest
        for digest in store.digests():
            data = (tmp_path / digest[:2] / digest[2:]).read_bytes()
            assert hashlib.sha256(data).hexdigest() == digest
        assert list((tmp_path / "drafts").iterdir()) == []
