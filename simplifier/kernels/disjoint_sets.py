"""Sets that only ever join, each a tree of parents (Galler and Fischer, "An Improved Equivalence
Algorithm", 1964)."""

from __future__ import annotations

from simplifier.kernels.compiled.kernel import inline_kernel


@inline_kernel
def root_of(parents, member):
    """Of the set that a member is in; halves the way there.

    ``parents`` (n,) int64: its own place of a root.
    """
    while parents[member] != member:
        parents[member] = parents[parents[member]]
        member = parents[member]
    return member
