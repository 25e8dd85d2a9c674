"""The command that compiles the kernels."""

from __future__ import annotations

from simplifier.cli.running import Debug, Quiet, run_guarded
from simplifier.warmup import warm_up


def warmup(quiet: Quiet = False, debug: Debug = False) -> None:
    """Compile and cache the kernels, so that the next start need not."""
    run_guarded(warm_up, debug=debug, quiet=quiet)
