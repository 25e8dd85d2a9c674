"""Changed files: the same for a seed, seldom unchanged, and JSON stays JSON."""

from __future__ import annotations

import json
from random import Random

import pytest

from tests.fuzz.corpus import kept_inputs
from tests.fuzz.mutation.documents import edit, edit_glb
from tests.fuzz.mutation.flips import flip
from tests.fuzz.mutation.words import reword
from tests.fuzz.targets import READERS, Target


@pytest.mark.parametrize("target", READERS, ids=lambda target: target.name)
def test_a_seed_gives_the_same_files(target: Target) -> None:
    contents = [path.read_bytes() for path in kept_inputs(target.name)]

    def changed(seed: int) -> list[bytes]:
        random = Random(seed)
        return [target.mutated(random, contents[0], contents[-1]) for _ in range(50)]

    assert changed(1) == changed(1)
    assert changed(1) != changed(2)
    assert len(set(changed(1)) - {contents[0]}) > 35


@pytest.mark.parametrize("change", [flip, reword, edit, edit_glb])
@pytest.mark.parametrize("data", [b"", b"\0", b"null", b"[]", b"{}", b"glTF", b"x y"])
def test_nothing_is_too_small_to_be_changed(change, data: bytes) -> None:
    for seed in range(60):
        assert isinstance(change(Random(seed), data, data), bytes)


def test_an_edited_document_is_one() -> None:
    (built,) = kept_inputs("manifest")[:1]
    document = built.read_bytes()
    for seed in range(100):
        document = edit(Random(seed), document, built.read_bytes())
        json.loads(document)


def test_an_edited_glb_keeps_its_chunks() -> None:
    glb = next(path for path in kept_inputs("glb") if path.name == "rich").read_bytes()
    begin = 20 + int.from_bytes(glb[12:16], "little")
    for seed in range(100):
        changed = edit_glb(Random(seed), glb, glb)
        length = int.from_bytes(changed[12:16], "little")
        assert int.from_bytes(changed[8:12], "little") == len(changed)
        json.loads(changed[20 : 20 + length])
        assert changed[20 + length :] == glb[begin:]
