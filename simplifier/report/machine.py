"""What a time was measured on."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from pathlib import Path

from simplifier.kernels.threads import thread_count


@dataclass(frozen=True)
class Machine:
    """The processor's name, its cores (as the system counts them), and the threads in use."""

    processor: str
    cores: int
    threads: int

    def __str__(self) -> str:
        cores = f"{self.cores} core{'' if self.cores == 1 else 's'}"
        return f"{self.processor}, {cores}, {self.threads} in use"


def this_machine() -> Machine:
    """The one that runs this."""
    return Machine(processor_name(), os.cpu_count() or 1, thread_count())


def processor_name() -> str:
    """As the system names it, or the instruction set where it has no name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
