"""The command ``git``, for tests of what works on repositories."""

from __future__ import annotations

import subprocess


def git(folder, *arguments):
    """Its standard output; commits are by an author of tests."""
    return subprocess.run(
        ["git", "-c", "user.name=t", "-c", "user.email=t@example.org", *arguments],
        cwd=folder, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
