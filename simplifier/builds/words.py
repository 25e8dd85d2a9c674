"""Findings in a few words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from simplifier.builds.finding import Finding, State


def headline(findings: Sequence[Finding]) -> str:
    """How many assets, in which states, and how many fall short."""
    counts = Counter(one.state for one in findings)
    words = [f"{counts[state]:,} {state}" for state in State if counts[state]]
    short = sum(1 for one in findings if one.short)
    if short:
        words.append(f"{short:,} not good enough")
    what = "asset" if len(findings) == 1 else "assets"
    return f"{len(findings):,} {what}: {', '.join(words)}"
