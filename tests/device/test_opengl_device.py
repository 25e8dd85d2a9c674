"""What the OpenGL device does where a card cannot, and when it is refused."""

from __future__ import annotations

import pytest

from simplifier.device import exact_program, opengl_device
from simplifier.device.card import LostError
from simplifier.device.device import PROCESSOR
from simplifier.device.opengl_device import OpenGLDevice
from simplifier.errors import BackendUnavailableError
from tests.kernels.test_coverage import FLAT
from tests.solids import sphere


@pytest.fixture
def device():
    try:
        made = OpenGLDevice()
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    yield made
    made.close()


def drawn(device):
    ball = sphere(20.0)
    return device.coverage_masks(ball.vertices, ball.faces, FLAT, 16, 16)


def test_what_does_not_fit_into_a_buffer_is_drawn_by_the_processor(device, monkeypatch):
    monkeypatch.setattr(device._card, "largest", 100)
    monkeypatch.setattr(opengl_device, "CoverageProgram", None)  # which would not be called
    assert (drawn(device) == drawn(PROCESSOR)).all()


def test_what_a_card_could_not_draw_is_drawn_by_the_processor(device, monkeypatch, caplog):
    asked = []

    def lost(*_):
        asked.append(1)
        raise LostError("GL_OUT_OF_MEMORY")

    monkeypatch.setattr(device._card, "read", lost)
    assert (drawn(device) == drawn(PROCESSOR)).all()
    assert asked == [1]
    assert "the processor does the work: GL_OUT_OF_MEMORY" in caplog.text


def test_a_closed_device_draws_by_the_processor(device):
    device.close()
    device.close()
    assert (drawn(device) == drawn(PROCESSOR)).all()


def test_opengl_that_rounds_otherwise_is_refused(device, monkeypatch):
    source = exact_program._SOURCE.replace("a / b", "a * (1.0LF / b)")
    monkeypatch.setattr(exact_program, "_SOURCE", source)
    with pytest.raises(BackendUnavailableError, match="does not compute in double precision"):
        OpenGLDevice()


def test_it_says_when_there_is_no_card(device, monkeypatch):
    monkeypatch.setattr(device, "_name", "llvmpipe (LLVM 15)")
    assert device.is_software
    assert "there is no graphics card" in device.remarks[0]
    monkeypatch.setattr(device, "_name", "NVIDIA GeForce RTX 4070/PCIe/SSE2")
    assert not device.is_software
    assert device.remarks == ()
