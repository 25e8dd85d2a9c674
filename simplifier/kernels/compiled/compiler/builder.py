"""How instructions are put one after another, without those that say nothing new."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite.ir import Constant, IntType, IRBuilder
from llvmlite.ir.instructions import InsertValue, PhiInstr

_INTEGER = IntType(64)


class Inserted(InsertValue):  # type: ignore[misc]
    """A value of several parts with one of them replaced; not written before it is read."""

    waits = True


class _Phi(PhiInstr):  # type: ignore[misc]
    """Reads values of other blocks, which are told after it was put where it is."""

    write: Callable[[Any], None]

    def add_incoming(self, value: Any, block: Any) -> None:
        self.write(value)
        super().add_incoming(value, block)


class LeanBuilder(IRBuilder):  # type: ignore[misc]
    """Takes a part of a value from where it was put in, and knows which integers are natural."""

    def __init__(self, block: Any = None) -> None:
        super().__init__(block)
        self.natural: set[Any] = set()
        """Integers that are no less than zero."""
        self.fixed: dict[Any, Any] = {}
        """Indices counted from the start, by their block, the index and the length."""
        self._extracted: dict[Any, Any] = {}

    def insert_value(self, agg: Any, value: Any, idx: Any, name: str = "") -> Any:
        places = idx if isinstance(idx, (tuple, list)) else [idx]
        return Inserted(self.block, agg, value, places, name=name)

    def extract_value(self, agg: Any, idx: Any, name: str = "") -> Any:
        places = tuple(idx) if isinstance(idx, (tuple, list)) else (idx,)
        while places:
            if isinstance(agg, Inserted):
                inside = tuple(agg.indices)
                if inside == places[: len(inside)]:
                    agg, places = agg.value, places[len(inside) :]
                elif inside[: len(places)] == places:
                    break  # a part of what is asked for was put in
                else:
                    agg = agg.aggregate
            elif isinstance(agg, Constant) and isinstance(agg.constant, (list, tuple)):
                agg, places = agg.constant[places[0]], places[1:]
            else:
                break
        if not places:
            return agg
        key = self.block, agg, places
        if key not in self._extracted:
            self._extracted[key] = super().extract_value(agg, places, name)
        return self._extracted[key]

    def phi(self, typ: Any, name: str = "", flags: Any = ()) -> Any:
        made = _Phi(self.block, typ, name=name, flags=flags)
        made.write = self._write
        self._insert(made)
        return made

    def _insert(self, instruction: Any) -> None:
        self._write(*instruction.operands)
        super()._insert(instruction)

    def _write(self, *values: Any) -> None:
        for one in values:
            if isinstance(one, Inserted) and one.waits:
                self._write(*one.operands)
                self._write_one(one)

    def _write_one(self, value: Inserted) -> None:
        """In the block where it was made, so that it comes before all that may read it."""
        value.waits = False
        block = value.parent
        if block is self._block:
            super()._insert(value)
        elif block.terminator is None:
            block.instructions.append(value)
        else:
            block.instructions.insert(len(block.instructions) - 1, value)

    def is_natural(self, value: Any) -> bool:
        """Whether it is an integer that is known to be no less than zero."""
        if isinstance(value, Constant):
            return isinstance(value.constant, int) and value.constant >= 0
        return value in self.natural

    def add(self, lhs: Any, rhs: Any, name: str = "", flags: Any = ()) -> Any:
        return self._of_naturals(super().add(lhs, rhs, name, flags), lhs, rhs)

    def mul(self, lhs: Any, rhs: Any, name: str = "", flags: Any = ()) -> Any:
        return self._of_naturals(super().mul(lhs, rhs, name, flags), lhs, rhs)

    def sext(self, value: Any, typ: Any, name: str = "") -> Any:
        return self._of_naturals(super().sext(value, typ, name), value)

    def _of_naturals(self, result: Any, *operands: Any) -> Any:
        """Sums and products of indices end far below where integers of 64 bits do."""
        if result.type == _INTEGER and all(map(self.is_natural, operands)):
            self.natural.add(result)
        return result
