"""What numba finds out of a kernel before it lowers it, without what nobody asks for here.

numba finds after every pass where each variable is read, written and last used; only the last pass
asks.  It looks for closures to put in line, for arithmetic of whole arrays and for texts as indices
in functions that have none, and keeps a description of what it does at each statement, for errors
that nobody reads here.  Types are found once, and a function that kernels call is compiled for
``int64`` where a caller gives a constant or a narrower integer, not once more for each.  None of
this changes what a kernel gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from types import BuiltinFunctionType
from typing import Any

import numba.core
from numba.core import base, compiler_machinery, event, ir, lowering, transforms, typeinfer
from numba.core.dispatcher import Dispatcher
from numba.core.errors import ForceLiteralArg, TypingError
from numba.core.ir_utils import fixup_var_define_in_scope
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.typed_passes import NopythonRewrites
from numba.core.types import Function
from numba.core.typing.context import BaseContext
from numba.core.untyped_passes import InlineClosureLikes
from numba.np.ufunc.array_exprs import _is_ufunc

types: Any = numba.core.types

_PACKAGE = "simplifier.kernels"

_SKIPPED, _VARIABLE, _STATEMENT, _LIST, _MAPPING = range(5)
_kinds: dict[type, int] = {}


def variables_of(statement: Any) -> list[Any]:
    """In place of numba's, which asks of each part of a statement in a call of its own."""
    return _variables_in(vars(statement).values(), [])


def variables_of_expression(expression: Any) -> list[Any]:
    """As :func:`variables_of`."""
    return _variables_in(expression._kws.values(), [])


def _variables_in(parts: Iterable[Any], found: list[Any]) -> list[Any]:
    """Those that are read or written, in numba's order."""
    for part in parts:
        kind = _kinds.get(type(part))
        if kind is None:
            kind = _kinds[type(part)] = _kind_of(part)
        if kind == _SKIPPED:
            continue
        if kind == _VARIABLE:
            found.append(part)
        elif kind == _STATEMENT:
            found += part.list_vars()
        else:
            _variables_in(part if kind == _LIST else part.values(), found)
    return found


def _kind_of(part: Any) -> int:
    for kind, known in (
        (_VARIABLE, ir.Var), (_STATEMENT, ir.Inst), (_LIST, (list, tuple)), (_MAPPING, dict),
    ):  # fmt: skip
        if isinstance(part, known):
            return kind
    return _SKIPPED


def _find_lifetimes(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """In place of ``PostProcessor.run``: lifetimes are found when they are asked for."""
    function = self.func_ir
    if function.is_generator:
        _numbas_find_lifetimes(self, emit_dels, extend_lifetimes)
        return
    _order_blocks(function)
    function.variable_lifetime = VariableLifetime(function.blocks)
    function.generator_info = None
    if emit_dels:
        self._insert_var_dels(extend_lifetimes=extend_lifetimes)


_numbas_find_lifetimes = PostProcessor.run


def _order_blocks(function: Any) -> None:
    """Give each loop one block that ends its turns, as numba does after every pass."""
    if _ways(function) != getattr(function, "ordered_ways", None):
        function.blocks = transforms.canonicalize_cfg(function.blocks)
        function.ordered_ways = _ways(function)


def _ways(function: Any) -> list[tuple[int, list[int]]]:
    """Where each block may go on."""
    return [(place, block.terminator.get_targets()) for place, block in function.blocks.items()]


def _rewrite_typed(self: Any, state: Any) -> bool:
    """In place of the pass: only where whole arrays are computed with, or a text is an index."""
    found = any(isinstance(kind, types.StringLiteral) for kind in state.typemap.values())
    if found or any(_is_of_arrays(*one, state.typemap) for one in _expressions(state.func_ir)):
        return bool(_numbas_rewrite(self, state))
    return False


_numbas_rewrite = NopythonRewrites.run_pass


def _is_of_arrays(name: str, expression: Any, kinds: Any) -> bool:
    if expression.op == "build_list":
        return True
    if not isinstance(kinds.get(name), types.Array):
        return False
    if expression.op != "call":
        return expression.op in ("unary", "binop")
    function = kinds.get(expression.func.name)
    return isinstance(function, types.Function) and _is_ufunc(function.typing_key)


def _expressions(function: Any) -> Iterator[tuple[str, Any]]:
    """What is computed, and the variable that it is put into."""
    for block in function.blocks.values():
        for statement in block.body:
            if isinstance(statement, ir.Assign) and isinstance(statement.value, ir.Expr):
                yield statement.target.name, statement.value


def _inline_closures(self: Any, state: Any) -> bool:
    """In place of the pass: only where there are closures, or lists that may become arrays."""
    function = state.func_ir
    if any(one.op in ("make_function", "build_list") for _, one in _expressions(function)):
        return bool(_numbas_inline(self, state))
    PostProcessor(function).run()
    fixup_var_define_in_scope(function.blocks)
    return True


_numbas_inline = InlineClosureLikes.run_pass


def _run_pass(self: Any, index: int, stage: Any, state: Any) -> None:
    """In place of numba's, which times each pass, tells listeners, and checks what it did."""
    stage.analysis = self._analysis
    mutated = False
    for part in (stage.run_initialization, stage.run_pass, stage.run_finalizer):
        mutated |= part(state)
    if compiler_machinery._pass_registry.get(type(stage)).mutates_CFG:
        if mutated:
            PostProcessor(state.func_ir).run()
        else:
            _order_blocks(state.func_ir)


def _propagate(self: Any, inference: Any) -> list[Any]:
    """In place of numba's, which opens a context for warnings at each constraint."""
    errors = []
    for constraint in self.constraints:
        try:
            constraint(inference)
        except (ForceLiteralArg, TypingError) as error:
            errors.append(error)
    return errors


def _type_of_value(self: Any, value: Any) -> Any:
    """In place of numba's, which tries buffers and more before it looks a built-in function up."""
    if type(value) is BuiltinFunctionType:
        found = self._get_global_type(value)
        if found is not None:
            return found
    return _numbas_type_of_value(self, value)


_numbas_type_of_value = BaseContext.resolve_value_type


def _call_template(self: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """In place of numba's: of which types a kernel is compiled that another one calls."""
    if self.py_func.__module__.startswith(_PACKAGE):
        given = tuple(map(_common, given))
    return _numbas_call_template(self, given, named)


_numbas_call_template = Dispatcher.get_call_template


def _common(kind: Any) -> Any:
    """The type for which a kernel is compiled that is given that one.

    A constant that is true or false stays one, since branches hang on it.  So do integers of 8 and
    16 bits: beside a float32 they give another float32, where those of 32 and 64 give a float64.
    """
    if isinstance(kind, types.Integer) and kind.signed and kind.bitwidth >= 32:
        return types.int64
    return kind


def _call_type(self: Any, context: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """In place of numba's, which tries template after template at every call."""
    key = self.typing_key, self.templates, given
    if named or key not in _resolved:
        found = _numbas_call_type(self, context, given, named)
        if not named:
            _resolved[key] = found, self.get_impl_key(found)
        return found
    found, implementation = _resolved[key]
    self._impl_keys[found.args] = implementation
    return found


_numbas_call_type = Function.get_call_type
_resolved: dict[Any, tuple[Any, Any]] = {}

_takes_place = cache(base._has_loc)
"""Whether a function that lowers takes a place in a source; numba asks at each call."""


class _Nothing:
    """A context without a description."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, *error: object) -> None:
        pass


def _undescribed(*arguments: Any, **named: Any) -> _Nothing:
    return _NOTHING


_NOTHING = _Nothing()


def look_less() -> None:
    """From now on, this process finds out no more than that."""
    for place, name, ours in (
        (ir.Stmt, "list_vars", variables_of),
        (ir.Expr, "list_vars", variables_of_expression),
        (PostProcessor, "run", _find_lifetimes),
        (NopythonRewrites, "run_pass", _rewrite_typed),
        (InlineClosureLikes, "run_pass", _inline_closures),
        (compiler_machinery.PassManager, "_runPass", _run_pass),
        (typeinfer.ConstraintNetwork, "propagate", _propagate),
        (BaseContext, "resolve_value_type", _type_of_value),
        (typeinfer, "new_error_context", _undescribed),
        (lowering, "new_error_context", _undescribed),
        (Dispatcher, "get_call_template", _call_template),
        (Function, "get_call_type", _call_type),
        (base, "_has_loc", _takes_place),
        (event, "trigger_event", _undescribed),
    ):
        setattr(place, name, ours)
