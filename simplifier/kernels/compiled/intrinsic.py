"""Functions that kernels call, written in LLVM's instructions: no loop compiles to as few."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any

Generate = Callable[[Any, Any], Any]
"""Takes a builder of llvmlite and the argument, a number or the address of an array's first
element; writes instructions, and returns their result, a number of the same type."""


class Intrinsic:
    """A function of one argument: ``plain`` for Python, what ``generate`` writes for kernels."""

    def __init__(self, plain: Callable[[Any], Any], generate: Generate) -> None:
        update_wrapper(self, plain)
        self.plain, self.generate = plain, generate

    def __call__(self, given: Any) -> Any:
        return self.plain(given)

    @cached_property
    def _numba_type_(self) -> Any:
        """How numba sees it."""
        from numba import types
        from numba.core.registry import cpu_target
        from numba.extending import intrinsic

        generate = self.generate

        @intrinsic
        def instructions(typingctx: Any, kind: Any) -> Any:
            is_array = isinstance(kind, types.Array)

            def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                (value,) = arguments
                if is_array:
                    value = context.make_array(kind)(context, builder, value).data
                return generate(builder, value)

            return (kind.dtype if is_array else kind)(kind), build

        context = cpu_target.typing_context
        context.refresh()  # it now knows the function
        return context.resolve_value_type(instructions)


def intrinsic(generate: Generate) -> Callable[[Callable[[Any], Any]], Intrinsic]:
    """Of a function as Python runs it, one for kernels too."""
    return lambda plain: Intrinsic(plain, generate)
