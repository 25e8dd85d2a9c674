"""The machine, the versions and the date that a result was made with, as one line each."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import simplifier
from simplifier.kernels.threads import thread_count
from simplifier.report.machine import processor_name

ROOT = Path(__file__).parents[1]

_PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "opencv-contrib-python-headless")


def header(command: str) -> tuple[str, ...]:
    """What every result file begins with: the command, the machine, the versions, the date."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return (f"command: {command}", f"machine: {machine()}", f"versions: {versions()}", f"on: {now}")


def machine() -> str:
    """Processor, cores in use, memory, operating system."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{processor_name()}, {thread_count()} threads, {memory:.0f} GiB, {platform.system()}"


def versions() -> str:
    """This library with its commit, Python, and the packages that do the computing."""
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    return (
        f"planar-occluder {simplifier.__version__}{_commit()}, "
        f"Python {sys.version.split()[0]}, {packages}"
    )


def _commit() -> str:
    """The commit in brackets, marked when tracked files were changed since; empty without git."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f" ({done.stdout.strip()})"
