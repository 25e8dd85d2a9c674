"""Instructions that say nothing new are not written, and the others say what they did."""

from __future__ import annotations

import ctypes

import llvmlite.binding as llvm
import pytest
from llvmlite import ir

from simplifier.kernels.compiled.compiler.builder import LeanBuilder

INTEGER = ir.IntType(64)
PAIR = ir.ArrayType(INTEGER, 2)
NESTED = ir.LiteralStructType([INTEGER, PAIR])


@pytest.fixture
def function():
    """Of three integers, with a builder in its first block."""
    module = ir.Module("builder")
    return ir.Function(module, ir.FunctionType(INTEGER, [INTEGER] * 3), "f")


@pytest.fixture
def builder(function):
    return LeanBuilder(function.append_basic_block("first"))


def run(function, *given):
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine()
    module = llvm.parse_assembly(str(function.module))
    module.verify()
    with llvm.create_mcjit_compiler(module, machine) as engine:
        engine.finalize_object()
        kind = ctypes.CFUNCTYPE(*[ctypes.c_int64] * 4)
        return kind(engine.get_function_address("f"))(*given)


def test_a_part_is_taken_from_where_it_was_put_in(function, builder):
    one, two, three = function.args
    pair = builder.insert_value(ir.Constant(PAIR, [7, 8]), one, 1)
    nested = builder.insert_value(ir.Constant(NESTED, ir.Undefined), pair, 1)
    nested = builder.insert_value(nested, two, 0)
    nested = builder.insert_value(nested, three, [1, 0])
    assert builder.extract_value(nested, 0) is two
    assert builder.extract_value(nested, [1, 1]) is one
    assert builder.extract_value(nested, [1, 0]) is three
    assert builder.extract_value(pair, 0).constant == 7
    assert not function.blocks[0].instructions


def test_a_value_that_was_put_together_is_read_as_a_whole(function, builder):
    one, two, three = function.args
    pair = builder.insert_value(ir.Constant(PAIR, [7, 8]), one, 1)
    nested = builder.insert_value(ir.Constant(NESTED, ir.Undefined), pair, 1)
    nested = builder.insert_value(nested, two, [1, 0])
    whole = builder.extract_value(nested, 1)
    place = builder.alloca(PAIR)
    builder.store(whole, place)
    first, second = (builder.extract_value(builder.load(place), part) for part in (0, 1))
    builder.ret(builder.add(builder.mul(first, three), second))
    assert run(function, 3, 5, 100) == 503


@pytest.mark.parametrize("given", [1, -1])
def test_values_of_other_blocks_are_written_where_they_were_made(function, builder, given):
    one, two, three = function.args
    before = builder.insert_value(ir.Constant(PAIR, [7, 8]), two, 0)
    branches = [function.append_basic_block(name) for name in ("more", "less")]
    last = function.append_basic_block("last")
    builder.cbranch(builder.icmp_signed(">", one, INTEGER(0)), *branches)
    made = []
    for place, block in enumerate(branches):
        builder.position_at_end(block)
        made.append(builder.insert_value(before, three, place))
        builder.branch(last)
    builder.position_at_end(last)
    either = builder.phi(PAIR)
    for value, block in zip(made, branches, strict=True):
        either.add_incoming(value, block)
    place = builder.alloca(PAIR)
    builder.store(either, place)
    first, second = (builder.extract_value(builder.load(place), part) for part in (0, 1))
    builder.ret(builder.add(builder.mul(first, INTEGER(1000)), second))
    assert run(function, given, 5, 6) == (6008 if given > 0 else 5006)


def test_only_what_is_known_to_be_no_less_than_zero_is_natural(function, builder):
    one, two, _ = function.args
    builder.natural.add(one)
    for natural in (INTEGER(0), one, builder.add(one, INTEGER(3)), builder.mul(one, one)):
        assert builder.is_natural(natural)
    for other in (
        INTEGER(-1),
        two,
        builder.add(one, INTEGER(-1)),
        builder.add(one, two),
        builder.sub(one, INTEGER(1)),
        builder.add(*[ir.Constant(ir.VectorType(INTEGER, 2), [1, 1])] * 2),
    ):
        assert not builder.is_natural(other)


def test_a_part_that_is_taken_twice_is_taken_once_in_each_block(function, builder):
    place = builder.alloca(PAIR)
    loaded = builder.load(place)
    first = builder.extract_value(loaded, 1)
    assert builder.extract_value(loaded, 1) is first
    assert builder.extract_value(loaded, 0) is not first
    builder.position_at_end(function.append_basic_block("second"))
    assert builder.extract_value(loaded, 1) is not first
