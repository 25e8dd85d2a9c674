"""For which processors machine code is made.

Code for one processor alone would have to be made anew on most others.  So it is made for kinds of
processors, each of which many have: code made elsewhere, in a wheel or an image, runs on all of a
kind, and hosts may share a folder of it.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import llvmlite.binding as llvm

_NAME, _FEATURES = "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"


@dataclass(frozen=True)
class Processor:
    """What machine code is made for: a name of LLVM's, and features beside what it implies."""

    name: str
    features: str = ""

    @property
    def variables(self) -> Mapping[str, str]:
        """The environment of a process that chooses it."""
        return {_NAME: self.name, _FEATURES: self.features}

    @property
    def has_wide_registers(self) -> bool:
        """Of 512 bits, as many as hold two images."""
        return self.name == "x86-64-v4" or "+avx512f" in self.features

    @property
    def gathers(self) -> bool:
        """Into a wide register, numbers from anywhere, by one instruction that takes flags."""
        return self.has_wide_registers and "+prefer-no-gather" not in self.features

    @property
    def moves_bytes(self) -> bool:
        """To any place in a register of 128 bits, by one instruction of x86's."""
        return self.name.startswith("x86-64-v") or "+ssse3" in self.features

    @property
    def counts_ones(self) -> bool:
        """Of each word in a wide register, by one instruction."""
        return "+avx512vpopcntdq" in self.features

    @classmethod
    def own(cls) -> Processor:
        """This very processor, with all that it has."""
        return cls(llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())

    @classmethod
    def chosen(cls) -> Processor:
        """The best kind that this processor is of, or this very one if it is of none.

        ``NUMBA_CPU_NAME`` and ``NUMBA_CPU_FEATURES`` choose another one; an empty name chooses
        this very one.
        """
        name = os.environ.get(_NAME)
        if name:
            return cls(name, os.environ.get(_FEATURES, ""))
        kinds = [] if name == "" else [one for one in kinds_here() if one.runs_here()]
        return kinds[0].processor if kinds else cls.own()


@dataclass(frozen=True)
class Kind:
    """Processors that have at least those features, by LLVM's names; ``name`` is ours."""

    name: str
    processor: Processor
    features: frozenset[str]

    def runs_here(self) -> bool:
        """Whether this processor is one of them."""
        here = llvm.get_host_cpu_features()
        return all(here.get(one, False) for one in self.features)


_LEVEL_3 = frozenset(["avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"])
_LEVEL_4 = frozenset(["avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl"])
_BITS = frozenset(["avx512bitalg", "avx512vbmi", "avx512vbmi2", "avx512vpopcntdq", "gfni"])
"""Beside its level, to count bits by the register; Intel's Ice Lake and AMD's Zen 4 have them."""

# An image is eight registers of 512 bits (``erosion.py``); LLVM avoids them if it is not told.
_WIDE = "-prefer-256-bit"

_X86_64 = (
    Kind(
        "x86-64-v4-bits",
        Processor("x86-64-v4", ",".join([*(f"+{one}" for one in sorted(_BITS)), _WIDE])),
        _LEVEL_3 | _LEVEL_4 | _BITS,
    ),
    # What gathers numbers leaks them on all of these (Intel's advisory 00828), and takes longer
    # than to load them one by one since microcode keeps it from that.
    Kind(
        "x86-64-v4",
        Processor("x86-64-v4", f"+prefer-no-gather,{_WIDE}"),
        _LEVEL_3 | _LEVEL_4,
    ),
    Kind("x86-64-v3", Processor("x86-64-v3"), _LEVEL_3),
)
_ARM64 = (Kind("arm64", Processor("generic"), frozenset({"neon"})),)


def kinds_here() -> Sequence[Kind]:
    """Kinds of processors of this machine's architecture, the best first."""
    match platform.machine().lower():
        case "x86_64" | "amd64":
            return _X86_64
        case "aarch64" | "arm64":
            return _ARM64
    return ()
