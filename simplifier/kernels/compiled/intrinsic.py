"""Functions that kernels call, written in LLVM's instructions: no loop compiles to as few."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from inspect import Parameter, Signature, signature
from typing import Any

Generate = Callable[..., Any]
"""Takes a builder of llvmlite and the arguments, numbers or the addresses of arrays' first
elements; writes instructions, and returns their result, a uint64."""


class Intrinsic:
    """A function: ``plain`` for Python, what ``generate`` writes for kernels."""

    def __init__(self, plain: Callable[..., Any], generate: Generate) -> None:
        update_wrapper(self, plain)
        self.plain, self.generate = plain, generate

    def __call__(self, *given: Any) -> Any:
        return self.plain(*given)

    @cached_property
    def _numba_type_(self) -> Any:
        """How numba sees it."""
        from numba import types
        from numba.core.registry import cpu_target
        from numba.extending import intrinsic

        generate = self.generate

        def instructions(typingctx: Any, *kinds: Any) -> Any:
            taken = [types.unliteral(kind) for kind in kinds]

            def build(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
                values = [
                    context.make_array(kind)(context, builder, value).data
                    if isinstance(kind, types.Array)
                    else value
                    for kind, value in zip(taken, arguments, strict=True)
                ]
                return generate(builder, *values)

            return types.uint64(*taken), build

        names = ["typingctx", *signature(self.plain).parameters]
        given = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
        # numba packs what a star takes into a tuple.
        instructions.__signature__ = Signature(given)  # type: ignore[attr-defined]
        known, context = intrinsic(instructions), cpu_target.typing_context
        context.refresh()  # it now knows the function
        return context.resolve_value_type(known)


def intrinsic(generate: Generate) -> Callable[[Callable[..., Any]], Intrinsic]:
    """Of a function as Python runs it, one for kernels too."""
    return lambda plain: Intrinsic(plain, generate)
