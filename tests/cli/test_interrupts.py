"""What Ctrl-C does, in a process of its own that says how far it is."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

import pytest

from simplifier.cli.running import interrupts
from tests.acceptance.command import environment

HEAD = """
import time
from simplifier.cli.running import interrupts

def say(word):
    print(word, flush=True)

with interrupts() as listening:
"""


def said(code, signals):
    """Exit status and words of code that says "ready", and then gets so many signals; one that is
    ended by them says so in a line."""
    with subprocess.Popen(
        [sys.executable, "-c", HEAD + code], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment(), text=True,
    ) as process:  # fmt: skip
        assert process.stdout.readline() == "ready\n"
        for _ in range(signals):
            process.send_signal(signal.SIGINT)
            time.sleep(0.1)  # two at once count as one
        words = process.stdout.read().split()
        line = "error: interrupted twice; ended at once\n"
        assert process.stderr.read() == (line if process.wait() == 130 else "")
    return process.returncode, words


DEFERRED = """
    with listening.deferred() as cancel:
        say("ready")
        cancel.wait(20.0)
        say("asked")
        time.sleep(WORK)
    say("after")
"""


def test_the_first_asks_and_the_second_ends_the_process():
    assert said(DEFERRED.replace("WORK", "0.0"), 1) == (0, ["asked", "after"])
    assert said(DEFERRED.replace("WORK", "60.0"), 2) == (130, ["asked"])


def test_held_work_is_ended_first():
    code = """
    with listening.held():
        say("ready")
        begin = time.monotonic()
        while time.monotonic() < begin + 1.0:
            time.sleep(0.001)
        say("done")
    say("after")
"""
    assert said(code, 1) == (0, ["done", "after"])
    assert said(code, 2) == (130, ["done"])


def test_elsewhere_it_raises_and_the_handler_goes_back():
    before = signal.getsignal(signal.SIGINT)
    with interrupts() as listening:
        assert not listening.heard
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert listening.heard
    assert signal.getsignal(signal.SIGINT) is before


def test_another_thread_hears_nothing():
    heard = []

    def work():
        with interrupts() as listening:
            heard.append(listening.heard)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert heard == [False]
