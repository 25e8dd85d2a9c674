"""LLVM's instructions that tell which triangles of a view have a pixel centre in their box."""

from __future__ import annotations

from typing import Any

import llvmlite.ir as ir

_LANES = 16
_WORD = ir.IntType(64)
_CELL = ir.IntType(32)
_CELLS = ir.VectorType(_CELL, _LANES)
_HALF = ir.Constant(_CELLS, [0xFFFF] * _LANES)
_NOTHING = ir.Constant(_CELLS, [0] * _LANES)


def write_pictured(builder: Any, cells: Any, faces: Any, begin: Any) -> Any:
    """As :func:`~..coverage.pictured` says."""
    word = _WORD(0)
    for group in range(0, 64, _LANES):
        first = builder.mul(builder.add(begin, _WORD(group)), _WORD(3))
        place = builder.gep(faces, [first])
        p, q, r = (_gathered(builder, cells, one) for one in _corners(builder, place))
        differ = builder.or_(builder.xor(p, q), builder.xor(p, r))
        columns = builder.icmp_unsigned("!=", builder.and_(differ, _HALF), _NOTHING)
        rows = builder.icmp_unsigned(">", differ, _HALF)
        both = builder.bitcast(builder.and_(columns, rows), ir.IntType(_LANES))
        word = builder.or_(word, builder.shl(builder.zext(both, _WORD), _WORD(group)))
    return word


def _corners(builder: Any, place: Any) -> Any:
    """The first, second and third corners of 16 faces, which lie one after the other."""
    kind = ir.VectorType(_CELL, 3 * _LANES)
    loaded = builder.load(builder.bitcast(place, kind.as_pointer()), align=4)
    for corner in range(3):
        order = ir.Constant(_CELLS, [3 * lane + corner for lane in range(_LANES)])
        yield builder.shuffle_vector(loaded, ir.Constant(kind, ir.Undefined), order)


def _gathered(builder: Any, cells: Any, vertices: Any) -> Any:
    """The cells of 16 vertices.  llvmlite takes no vector for an offset, so places are numbers."""
    kind = ir.VectorType(_CELL.as_pointer(), _LANES)
    flags = ir.VectorType(ir.IntType(1), _LANES)
    name = f"llvm.masked.gather.v{_LANES}i32.v{_LANES}p0"
    words = ir.VectorType(_WORD, _LANES)
    base = builder.insert_element(
        ir.Constant(words, ir.Undefined), builder.ptrtoint(cells, _WORD), _CELL(0)
    )
    base = builder.shuffle_vector(base, ir.Constant(words, ir.Undefined), _NOTHING)
    offsets = builder.shl(builder.zext(vertices, words), ir.Constant(words, [2] * _LANES))
    places = builder.inttoptr(builder.add(base, offsets), kind)
    function = ir.FunctionType(_CELLS, [kind, _CELL, flags, _CELLS])
    known = builder.module.globals.get(name)
    all_of_them = ir.Constant(flags, [1] * _LANES)
    return builder.call(
        known or ir.Function(builder.module, function, name),
        [places, _CELL(4), all_of_them, ir.Constant(_CELLS, ir.Undefined)],
    )
