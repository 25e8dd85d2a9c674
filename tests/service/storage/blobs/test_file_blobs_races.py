"""Blobs while others sweep, and when the process is killed: by threads and by real kills."""

from __future__ import annotations

import hashlib
import random
import subprocess
import sys

import pytest

from service.jobs.job import Blob
from service.storage.blobs.file_blobs import FileBlobs
from tests.service.storage.blobs.racing import Rows, race


@pytest.mark.parametrize("removed", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_no_sweep_takes_what_a_row_names(tmp_path, removed):
    """Few contents and many threads, so that all meet at the same blobs all the time."""
    store, rows = FileBlobs(tmp_path), Rows()
    contents = [bytes([i]) * 100 for i in range(12)]
    race([store], rows, contents, lambda: store.sweep(rows.unnamed), removed)
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
