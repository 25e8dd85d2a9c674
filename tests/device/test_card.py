"""What lies on a card: what is filled, what is used again, and what stays."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.device.card import Card, Filled
from simplifier.device.opengl_context import open_context
from simplifier.errors import BackendUnavailableError
from tests.solids import sphere


@pytest.fixture
def card():
    try:
        context, _ = open_context("a test", "nothing", 430)
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    with context:
        yield Card(context)
    context.release()


def shape(radius):
    ball = sphere(radius)
    return np.ascontiguousarray(ball.vertices.T), ball.faces


@pytest.mark.parametrize("word", [0, 7, 0xFFFFFFFF])
def test_a_buffer_begins_with_what_it_is_filled_with(card, word):
    for size in (4, 4096, 1 << 20):
        with card.buffers(Filled(size, word)) as (buffer,):
            assert (card.read(buffer, np.uint32, (size // 4,)) == word).all()


def test_a_buffer_is_used_again_unless_it_was_read(card):
    """A driver moves what is read to the memory of the processor."""
    with card.buffers(Filled(4096)) as (first,):
        pass
    with card.buffers(Filled(4096, 3), Filled(4096, 5)) as (again, other):
        assert again is first
        assert other is not first
        assert (card.read(again, np.uint32, (1024,)) == 3).all()
    with card.buffers(Filled(4096), Filled(4096)) as (third, fourth):
        assert third is other
        assert fourth not in (first, other)


def test_buffers_that_wait_take_bounded_memory(card, monkeypatch):
    monkeypatch.setattr("simplifier.device.card._SPARE", 10_000)
    for size in (4000, 6000, 8000, 12_000):
        with card.buffers(Filled(size)):
            pass
    assert [one.size for one in card._spare] == [8000]


def test_the_last_shapes_stay(card):
    first, second, third = (shape(radius) for radius in (1.0, 2.0, 3.0))
    (one,) = card.geometries([first])
    assert card.geometries([tuple(part.copy() for part in first)]) == [one]
    kept = card.geometries([first, second])
    assert kept[0] is one
    assert [two.glo for two in kept[1].buffers] == [two.glo for two in card._kept[1].buffers]
    several = card.geometries([third, first, second])
    assert several[1:] == kept
    (last,) = card.geometries([third])
    assert last is several[0]
    assert len(card._kept) == 2
    (anew,) = card.geometries([second])
    assert anew is not kept[1]
