"""Keeps Ray's driver running, which Ray ends where a raylet or the head is gone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from service.ray_cluster.driver import JOINED
from simplifier.cli.plugin import print_line, print_text

_FIRST_PAUSE, _LONGEST_PAUSE = 1.0, 15.0  # seconds before a driver that has ended is started again
_WELL = 60.0  # seconds after which one that ends is no failure to start
_GLANCE = 0.1


class _Orders:
    """What signals have said, and to whom they are passed on."""

    def __init__(self) -> None:
        self.ending = False
        self.driver: subprocess.Popen[bytes] | None = None

    def handle(self, number: int, frame: FrameType | None) -> None:
        if self.driver is not None:
            with suppress(ProcessLookupError):
                os.kill(self.driver.pid, signal.SIGTERM)
        elif self.ending:
            os._exit(128 + number)
        self.ending = True


def keep_dispatching() -> int:
    """Have a driver until a signal says to end; the exit status.

    One that never began to offer has told why, and is not started again.
    """
    begun, pause = False, _FIRST_PAUSE
    with _heard() as orders:
        while not orders.ending:
            since = time.monotonic()
            status, joined = _run_driver(orders, tell=not begun)
            if status == 0 or orders.ending or not (begun or joined):
                return status if status >= 0 else 1
            begun = True
            pause = _FIRST_PAUSE if time.monotonic() - since > _WELL else pause
            print_line(
                f"warning: Ray's driver has ended with status {status}, as it does where the head "
                f"or the raylet of this machine is gone; the next one begins in {pause:.0f} s"
            )
            until = time.monotonic() + pause
            while time.monotonic() < until and not orders.ending:
                time.sleep(_GLANCE)
            pause = min(2.0 * pause, _LONGEST_PAUSE)
    return 0


def _run_driver(orders: _Orders, *, tell: bool) -> tuple[int, bool]:
    """Its exit status, and whether it had joined."""
    ours, theirs = os.pipe()
    try:
        driver = subprocess.Popen(
            [sys.executable, "-m", "service.cli.dispatch_driver", str(theirs)],
            stdin=subprocess.PIPE,  # its end tells the driver that this process is gone
            pass_fds=[theirs],
            process_group=0,  # Ctrl-C comes to it by this process, once
        )
    finally:
        os.close(theirs)
    orders.driver = driver
    try:
        with driver, open(ours, "rb") as pipe:  # noqa: PTH123 - a descriptor
            joined = pipe.readline() == JOINED
            if joined and tell:
                print_text("occluder dispatches")
            return driver.wait(), joined
    finally:
        orders.driver = None


@contextmanager
def _heard() -> Iterator[_Orders]:
    orders = _Orders()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, orders.handle) for number in numbers}
    try:
        yield orders
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
