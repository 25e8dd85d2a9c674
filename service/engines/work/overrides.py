"""The overrides that came with a mesh."""

from __future__ import annotations

import simplifier
from service.engines.messages import Task
from service.engines.work.refusals import input_label

_NAME = "overrides"


def read_overrides(task: Task) -> simplifier.Overrides:
    """None decided where none came.  Raises :class:`simplifier.OverridesError`."""
    if _NAME not in task.inputs:
        return simplifier.Overrides()
    return simplifier.load_overrides(task.inputs[_NAME], name=input_label(task, _NAME))
