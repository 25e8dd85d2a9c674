"""Which variables of a function need no memory, since each stands for one value."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from numba.core import ir
from numba.core.analysis import compute_cfg_from_blocks


def single_values(blocks: Mapping[int, Any], counted: Callable[[str], bool]) -> set[str]:
    """The names of variables that are assigned once, before all that reads them.

    ``blocks`` are lowered in the order of their keys.  Where references in a variable are
    ``counted``, it is also given up once for each time that it is assigned.
    """
    assigned, given_up = _places(blocks)
    graph = compute_cfg_from_blocks(blocks)
    once = {
        name: places[0]
        for name, places in assigned.items()
        if len(places) == 1
        and not (counted(name) and not _is_paired(graph, places[0], given_up.get(name, ())))
    }
    for name in _read_elsewhere(blocks, once, graph.dominators(), counted):
        once.pop(name, None)
    return set(once)


def _read_by(value: Any) -> list[Any]:
    """The variables that the right side of an assignment reads."""
    if isinstance(value, ir.Var):
        return [value]
    found: list[Any] = value.list_vars() if isinstance(value, ir.Inst) else []
    return found


def _places(blocks: Mapping[int, Any]) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
    """The blocks where each variable is assigned, and where it is given up."""
    assigned: dict[str, list[int]] = {}
    given_up: dict[str, list[int]] = {}
    for offset, block in blocks.items():
        for statement in block.body:
            if isinstance(statement, ir.Assign):
                assigned.setdefault(statement.target.name, []).append(offset)
            elif isinstance(statement, ir.Del):
                given_up.setdefault(statement.value, []).append(offset)
    return assigned, given_up


def _is_paired(graph: Any, assigned: int, given_up: Sequence[int]) -> bool:
    """Whether a variable is given up once whenever it was assigned.

    numba may give one up several times on one way, or in each turn of a loop, since it clears the
    memory of what it has given up.
    """
    if len(given_up) != 1:
        return False
    (end,) = given_up
    return end == assigned or bool(graph.in_loops(end) == graph.in_loops(assigned))


def _read_elsewhere(
    blocks: Mapping[int, Any],
    once: Mapping[str, int],
    before: Mapping[int, set[int]],
    counted: Callable[[str], bool],
) -> Iterator[str]:
    """Those that something reads which may come before they are assigned, or is lowered before."""
    for offset, block in blocks.items():
        assigned: set[str] = set()
        for statement in block.body:
            for name in _names_read(statement, counted):
                place = once.get(name)
                if place == offset:
                    if name not in assigned:
                        yield name
                elif place is not None and not (place < offset and place in before[offset]):
                    yield name
            if isinstance(statement, ir.Assign):
                assigned.add(statement.target.name)


def _names_read(statement: Any, counted: Callable[[str], bool]) -> list[str]:
    if isinstance(statement, ir.Del):
        return [statement.value] if counted(statement.value) else []
    if isinstance(statement, ir.Assign):
        return [one.name for one in _read_by(statement.value)]
    return [one.name for one in statement.list_vars()]
