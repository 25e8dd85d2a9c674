"""For which kind of processors machine code is chosen, whatever this processor is."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import pytest

from simplifier.kernels.compiled.processors import Processor, kinds_here

HASWELL = ["avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.2"]
SKYLAKE_X = [*HASWELL, *["avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl"]]
ICE_LAKE = [*SKYLAKE_X, *["avx512bitalg", "avx512vbmi", "avx512vbmi2", "avx512vpopcntdq", "gfni"]]
LINUX_NAMES = {"bmi": "bmi1", "lzcnt": "abm", "avx512vbmi2": "avx512_vbmi2",
               "avx512bitalg": "avx512_bitalg", "avx512vpopcntdq": "avx512_vpopcntdq"}  # fmt: skip
LOADER = Path("/lib64/ld-linux-x86-64.so.2")


class Features(dict):
    def flatten(self):
        return ",".join(f"+{name}" for name in self)


@pytest.fixture
def machine(monkeypatch):
    """Pretend to be another machine, with nothing chosen in the environment."""
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(name, raising=False)

    def pretend(architecture, features):
        monkeypatch.setattr(platform, "machine", lambda: architecture)
        monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: "itself")
        monkeypatch.setattr(
            llvm, "get_host_cpu_features", lambda: Features.fromkeys(features, True)
        )

    return pretend


@pytest.mark.parametrize(
    ("architecture", "features", "name", "wide", "counts"),
    [
        ("x86_64", ICE_LAKE, "x86-64-v4", True, True),
        ("AMD64", ICE_LAKE, "x86-64-v4", True, True),  # as Windows says
        ("x86_64", SKYLAKE_X, "x86-64-v4", True, False),
        ("x86_64", HASWELL, "x86-64-v3", False, False),
        ("x86_64", HASWELL[:1], "itself", False, False),
        ("arm64", ["neon"], "generic", False, False),
        ("aarch64", ["neon"], "generic", False, False),
        ("riscv64", ["v"], "itself", False, False),
    ],
)
def test_the_best_kind_that_the_processor_is_of(
    machine, architecture, features, name, wide, counts
):
    machine(architecture, features)
    chosen = Processor.chosen()
    assert chosen.name == name
    assert chosen.has_wide_registers == wide
    assert chosen.counts_ones == counts


def test_each_kind_has_a_name_of_its_own():
    kinds = kinds_here()
    assert len({kind.name for kind in kinds}) == len({kind.processor for kind in kinds}) > 0


def test_whoever_says_otherwise_is_obeyed(machine, monkeypatch):
    machine("x86_64", HASWELL)
    monkeypatch.setenv("NUMBA_CPU_NAME", "znver3")
    assert Processor.chosen() == Processor("znver3")
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+avx2")
    assert Processor.chosen() == Processor("znver3", "+avx2")
    monkeypatch.setenv("NUMBA_CPU_NAME", "")
    assert Processor.chosen() == Processor("itself", Features.fromkeys(HASWELL).flatten())


def test_a_process_with_its_variables_chooses_it(machine, monkeypatch):
    machine("x86_64", HASWELL)
    for one in (*kinds_here(), Processor.own()):
        processor = getattr(one, "processor", one)
        with monkeypatch.context() as patched:
            for name, value in processor.variables.items():
                patched.setenv(name, value)
            assert Processor.chosen() == processor


def test_llvm_knows_their_names_and_features():
    known = llvm.get_host_cpu_features().keys()
    for kind in kinds_here():
        assert kind.features <= known
    # LLVM prints what it does not know, and goes on.
    code = """
import llvmlite.binding as llvm
from simplifier.kernels.compiled.processors import kinds_here
llvm.initialize_native_target()
target = llvm.Target.from_default_triple()
for kind in kinds_here():
    one = kind.processor
    target.create_target_machine(cpu=one.name, features=one.features)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""


@pytest.mark.skipif(not LOADER.exists(), reason="asks the loader of Linux on x86-64")
def test_this_processor_is_of_the_kinds_that_linux_says():
    told = subprocess.run([LOADER, "--help"], capture_output=True, text=True, check=True).stdout
    assert kinds_here()[-1].runs_here() == ("x86-64-v3 (supported" in told)
    (flags,) = {
        line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags")
    }
    for kind in kinds_here():
        names = {LINUX_NAMES.get(name, name) for name in kind.features}
        assert kind.runs_here() == (names <= set(flags.split()))
