"""Which device a choice gives, on machines with and without OpenGL and cards."""

from __future__ import annotations

import subprocess
import sys

import pytest

from simplifier.device import choice
from simplifier.device.choice import close_device, open_device
from simplifier.device.device import PROCESSOR
from simplifier.device.opengl_device import OpenGLDevice


@pytest.fixture(autouse=True)
def _fresh():
    """What is opened under a changed machine does not stay."""
    close_device()
    yield
    close_device()


def card(monkeypatch, there):
    monkeypatch.setattr(choice, "_has_card", lambda: there)


def opengl():
    found = open_device("gpu")
    if found is PROCESSOR or not isinstance(found, OpenGLDevice):
        pytest.skip(*found.remarks)
    return found


def test_a_process_has_one_context_until_it_is_closed():
    first = opengl()
    assert open_device("gpu") is first
    close_device()
    assert open_device("gpu") is not first


def test_the_processor_is_taken_at_once():
    assert open_device("cpu") is PROCESSOR


def test_auto_asks_no_driver_where_there_is_no_card(monkeypatch):
    card(monkeypatch, there=False)
    monkeypatch.setattr(choice, "OpenGLDevice", None)  # which would not be called
    assert open_device("auto") is PROCESSOR


@pytest.mark.parametrize(("software", "taken"), [(True, False), (False, True)])
def test_auto_takes_cards_and_no_software(monkeypatch, software, taken):
    card(monkeypatch, there=True)
    found = opengl()
    name = "llvmpipe" if software else "AMD Radeon"
    monkeypatch.setattr(found, "_name", name)
    assert (open_device("auto") is found) == taken


@pytest.mark.parametrize("package", ["moderngl", "glcontext"])
def test_without_opengl_the_processor_works_and_says_why(monkeypatch, package):
    card(monkeypatch, there=True)
    monkeypatch.setitem(sys.modules, package, None)
    found = open_device("gpu")
    assert found.name == "cpu"
    (remark,) = found.remarks
    assert remark.startswith(
        f"the processor did all the work: device gpu: the Python package {package} is missing"
    )
    assert "'gl' extra" in remark
    assert remark.endswith("or use --device cpu")
    assert open_device("auto") is PROCESSOR  # which was not promised anything else


def test_the_choice_loads_no_opengl_before_it_is_asked_to():
    """The cpu must do where the gl extra is not installed."""
    code = (
        "import sys; from simplifier.device.choice import open_device; open_device('cpu');"
        "sys.exit('moderngl' in sys.modules or 'glcontext' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
