"""Why a peer made nothing of a mesh."""

from __future__ import annotations


class PeerFailedError(Exception):
    """There is no occluder, and why."""
