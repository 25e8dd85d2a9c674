"""The mesh of a task, with the overrides that came along."""

from __future__ import annotations

import simplifier
from service.engines.messages import Task
from service.engines.work.refusals import input_label, input_path

_OVERRIDES = "overrides"

Options = simplifier.SimplifyOptions | simplifier.EvaluateOptions | simplifier.TradeoffOptions


def read_mesh(task: Task, options: Options) -> tuple[simplifier.TriangleMesh, simplifier.Overrides]:
    """Without what the overrides ignore; none are decided where none came.

    Raises :class:`simplifier.OccluderError`.
    """
    overrides = simplifier.Overrides()
    if _OVERRIDES in task.inputs:
        label = input_label(task, _OVERRIDES)
        overrides = simplifier.load_overrides(task.inputs[_OVERRIDES], name=label)
    mesh = simplifier.load(
        input_path(task, "mesh"),
        allow_external=False,
        transparent=options.transparent,
        ignore=overrides.ignore,
        memory_limit=options.memory_limit,
    )
    return mesh, overrides
