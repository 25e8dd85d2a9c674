"""Which mistakes are made in a source, and that it is whole again after each."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.mutants.operators import mutants
from tests.mutants.targets import TARGETS, Target

SOURCE = '''
"""Text stays: 1 < 2."""
from __future__ import annotations
LIMIT = 0.5
def guard(low: int | None, high=3, *more):
    """Text stays."""
    if low < high and more[0]:
        raise ValueError("1 < 2")
    return min(low, -high) if low is None else abs(low)
class Box:
    size: int = 4
    @cached(7)
    def grow(self, by: int) -> None:
        self.size += by
        while not self.full:
            self.tell(by, times=2)
'''

EXPECTED = """
LIMIT = 0.5 -> LIMIT = 0.0
if low < high and more[0]: -> if False:
if low < high and more[0]: -> if low < high or more[0]:
if low < high and more[0]: -> if more[0]:
if low < high and more[0]: -> if low < high:
if low < high and more[0]: -> if low <= high and more[0]:
return min(low, -high) if low is None else abs(low) -> return abs(low) if low is None else min(low, -high)
return min(low, -high) if low is None else abs(low) -> return min(low, -high) if low is not None else abs(low)
return min(low, -high) if low is None else abs(low) -> return max(low, -high) if low is None else abs(low)
return min(low, -high) if low is None else abs(low) -> return min(low, high) if low is None else abs(low)
return min(low, -high) if low is None else abs(low) -> return min(low, -high) if low is None else low
self.size += by -> pass
self.size += by -> self.size -= by
while not self.full: -> while self.full:
self.tell(by, times=2) -> pass
self.tell(by, times=2) -> self.tell(by, times=3)
"""  # noqa: E501


def test_each_mistake_once() -> None:
    found = [f"{one.before} -> {one.after}" for one in mutants(SOURCE)]
    assert found == EXPECTED.strip().splitlines()


def test_each_says_where_it_is() -> None:
    owners = {(one.function, one.name) for one in mutants(SOURCE)}
    assert owners == {("", "LIMIT"), ("guard", None), ("Box.grow", None)}
    twice = "def f(x):\n    x.go()\n    x.go()\n"
    assert [(one.line, one.number) for one in mutants(twice)] == [(2, 1), (3, 2)]


@pytest.mark.parametrize("target", TARGETS, ids=lambda one: one.file)
def test_every_mutant_of_a_target_has_a_name_of_its_own_and_is_python(target: Target) -> None:
    source = Path(target.file).read_text()
    keys = []
    for one in mutants(source):
        assert one.before != one.after
        keys.append(one.key)
        if len(keys) % 16 == 1:  # compiling takes a hundredth of a second
            compile(ast.fix_missing_locations(one.module), target.file, "exec")
    assert len(set(keys)) == len(keys) > 0
