"""Any history of puts, rows, sweeps and kills: a blob that a row names is there, and whole."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Collection
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from service.storage.blobs.file_blobs import FileBlobs
from tests.service.storage.blobs.blob_store_contract import blob_of

CONTENTS = [b"", b"a", b"b" * 70_000, b"c" * 300]
contents = st.sampled_from(CONTENTS)


class History(RuleBasedStateMachine):
    """Beside the store a plain model: what is stored, what rows name, what each keeping holds."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder
        self.stored: set[bytes] = set()
        self.rows: Counter[bytes] = Counter()
        self.keepings: list[tuple[object, object, set[bytes]]] = []
        self.start()
        self.store.sweep(set)  # what the history before this one has left

    def start(self) -> None:
        self.store = FileBlobs(self.folder)

    def open_keeping(self) -> None:
        block = self.store.keeping()
        self.keepings.append((block, block.__enter__(), set()))

    @rule()
    def begin(self) -> None:
        self.open_keeping()

    @precondition(lambda self: self.keepings)
    @rule(data=contents, which=st.integers(0), way=st.sampled_from(["put", "file"]))
    def put(self, data: bytes, which: int, way: str) -> None:
        _, keeping, held = self.keepings[which % len(self.keepings)]
        if way == "put":
            blob = keeping.put(io.BytesIO(data))
        else:
            path = self.folder.parent / f"{self.folder.name}.source"
            path.write_bytes(data)
            blob = keeping.put_file(path)
            assert not path.exists()
        assert blob == blob_of(data)
        self.stored.add(data)
        held.add(data)

    @precondition(lambda self: self.keepings)
    @rule(data=contents, which=st.integers(0))
    def adopt(self, data: bytes, which: int) -> None:
        _, keeping, held = self.keepings[which % len(self.keepings)]
        if data in self.stored:
            keeping.adopt(blob_of(data))
            held.add(data)
        else:
            with pytest.raises(KeyError):
                keeping.adopt(blob_of(data))

    @precondition(lambda self: self.keepings)
    @rule(which=st.integers(0), commits=st.booleans())
    def end(self, which: int, commits: bool) -> None:
        block, _, held = self.keepings.pop(which % len(self.keepings))
        if commits:
            self.rows.update(held)
        block.__exit__(None, None, None)

    @precondition(lambda self: +self.rows)
    @rule(which=st.integers(0))
    def forget(self, which: int) -> None:
        named = sorted(+self.rows)
        self.rows[named[which % len(named)]] -= 1

    @rule(
        midst=st.lists(st.sampled_from(["put", "adopt", "end", "forget"]), max_size=4),
        data=contents,
    )
    def sweep(self, midst: list[str], data: bytes) -> None:
        """Things happen right after the names were read."""
        held = set[bytes]().union(*(held for _, _, held in self.keepings))
        names_read = set(+self.rows)

        def unnamed(digests: Collection[str]) -> set[str]:
            for step in midst:
                if step == "forget" and +self.rows:
                    self.forget(0)
                elif step == "end" and self.keepings:
                    self.end(0, True)
                elif step in ("put", "adopt"):
                    self.open_keeping()
                    if step == "put":
                        self.put(data, -1, "put")
                    else:
                        self.adopt(data, -1)
                    held.update(self.keepings[-1][2])
                    self.end(-1, True)
            return set(digests) - {blob_of(one).digest for one in names_read}

        self.store.sweep(unnamed)
        self.stored &= names_read | held

    @rule(data=contents)
    def kill(self, data: bytes) -> None:
        """In the midst of a put and of every keeping: the objects are left as they are."""
        self.store.draft().write(data)
        self.keepings.clear()
        self.start()
        assert list((self.folder / "drafts").iterdir()) == []

    @invariant()
    def the_store_is_as_the_model(self) -> None:
        assert set(self.store.digests()) == {blob_of(data).digest for data in self.stored}
        for data in +self.rows:
            assert data in self.stored
            with self.store.open(blob_of(data)) as file:
                assert file.read() == data


def test_any_history(tmp_path):
    run_state_machine_as_test(
        lambda: History(tmp_path / "blobs"),
        settings=settings(max_examples=16, stateful_step_count=25, deadline=None),
    )
