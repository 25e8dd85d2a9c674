"""What is found out of a kernel before it is lowered, against what numba finds."""

from __future__ import annotations


def test_variables_of_statements_are_those_that_numba_finds():
    from numba.core import ir
    from numba.core.compiler import run_frontend

    from simplifier.kernels import annealing, decimate
    from simplifier.kernels.compiled.compiler.front_end import variables_of, variables_of_expression
    from simplifier.kernels.compiled.kernel import Kernel

    kernels = [one for file in (annealing, decimate) for one in vars(file).values()
               if isinstance(one, Kernel)]  # fmt: skip
    compared = 0
    for kernel in kernels:
        for block in run_frontend(kernel.function).blocks.values():
            for statement in block.body:
                wanted = ir.Inst._rec_list_vars(statement, vars(statement))
                assert variables_of(statement) == wanted
                value = getattr(statement, "value", None)
                if isinstance(value, ir.Expr):
                    wanted = ir.Inst._rec_list_vars(value, value._kws)
                    assert variables_of_expression(value) == wanted
                    compared += 1
    assert compared > 1000
