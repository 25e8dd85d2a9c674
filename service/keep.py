"""Which files of a result are stored."""

from __future__ import annotations

from enum import StrEnum


class Keep(StrEnum):
    """Which files of an occluder's or an evaluation's result are stored as its job ends."""

    ALL = "all"
    """Every level by itself in every format, and the original to look at."""
    LEAN = "lean"
    """The occluder and its report, and what all others are made from when somebody asks for one."""
