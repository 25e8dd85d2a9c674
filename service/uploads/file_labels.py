"""What people call a file: shown to people, and never a path of ours."""

from __future__ import annotations

import re
import unicodedata
from pathlib import PurePosixPath

_LONGEST = 200
_LONGEST_SUFFIX = 20
# Control, format (bidirectional controls among them), surrogate, line and paragraph separators.
_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})


def file_label(name: str) -> str:
    """The last step of a path of any system, without what cannot be seen, at most 200 characters.

    What is too long loses the end of its stem.  Empty where nothing is left.
    """
    last = re.split(r"[/\\]", name)[-1]
    label = "".join(one for one in last if unicodedata.category(one) not in _UNSEEN).strip()
    if not label.strip("."):
        return ""
    suffix = PurePosixPath(label).suffix
    if len(label) <= _LONGEST or len(suffix) > _LONGEST_SUFFIX:
        return label[:_LONGEST]
    return label[: _LONGEST - len(suffix)] + suffix
