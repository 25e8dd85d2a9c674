"""Which device a run uses."""

from __future__ import annotations

import atexit
from pathlib import Path
from threading import Lock

from simplifier.device.device import PROCESSOR, Device, Processor
from simplifier.device.opengl_device import OpenGLDevice
from simplifier.errors import BackendUnavailableError
from simplifier.options.simplify import DeviceChoice

_CARDS = ("dri/renderD*", "nvidiactl", "dxg")  # of Linux, of NVIDIA's driver, of Windows' Linux

_lock = Lock()
_opened: OpenGLDevice | BackendUnavailableError | None = None


def open_device(choice: DeviceChoice) -> Device:
    """The device of a choice; never fails.

    ``auto`` takes the processor unless there is a graphics card, ``gpu`` whatever OpenGL there is.
    Where there is none the processor does the work, and its remark says why.  A process has one
    OpenGL context, which is opened when it is first asked for and kept until the process ends.
    """
    if choice == "cpu" or (choice == "auto" and not _has_card()):
        return PROCESSOR
    found = _opengl_device()
    if isinstance(found, BackendUnavailableError):
        remark = f"the processor did all the work: {found}"
        return Processor((remark,)) if choice == "gpu" else PROCESSOR
    return PROCESSOR if choice == "auto" and found.is_software else found


def close_device() -> None:
    """Free the OpenGL context, if there is one; the next who asks opens another."""
    global _opened
    with _lock:
        if isinstance(_opened, OpenGLDevice):
            _opened.close()
        _opened = None


def _opengl_device() -> OpenGLDevice | BackendUnavailableError:
    global _opened
    with _lock:
        if _opened is None:
            try:
                _opened = OpenGLDevice()
                atexit.register(close_device)
            except BackendUnavailableError as error:
                _opened = error
        return _opened


def _has_card() -> bool:
    """Whether the system shows a graphics card: what can be told without opening OpenGL."""
    return any(next(Path("/dev").glob(name), None) for name in _CARDS)
