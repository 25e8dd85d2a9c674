"""Kernels as Python calls them."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simplifier import kernels
from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compiled.code_files import kernel_files
from simplifier.kernels.compiled.kernel import Kernel, inner_kernel
from simplifier.kernels.measure import distance_sum, score_images
from tests.acceptance.command import ROOT, environment

IMAGES = np.arange(128, dtype=np.uint64).reshape(2, 64) << np.uint64(20)


def test_a_kernel_says_what_it_takes():
    assert score_images.__name__ == "score_images"
    assert score_images.__doc__
    assert str(score_images.signature) == "(uint64[:, :])"


@pytest.mark.parametrize("name", kernel_files())
def test_no_kernel_takes_a_new_array_apart_by_rows(name):
    """As ``a, b = np.empty((2, n))``: no loop over such rows is vectorized, six times as long."""
    path = Path(kernels.__path__[0]) / f"{name}.py"
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            made = ast.unparse(node.value)
            is_new = made.startswith(("np.empty", "np.full", "np.ones", "np.zeros"))
            assert not is_new, f"line {node.lineno}: index the rows of {made}"


def test_in_tests_what_does_not_fit_is_an_error():
    with pytest.raises(TypeError, match=r"measure.score_images: argument 0 is int64\[:, :\]"):
        score_images(IMAGES.astype(np.int64))
    with pytest.raises(TypeError, match="0 arguments, where it takes 1"):
        score_images()


def test_elsewhere_it_is_compiled_for(monkeypatch, caplog):
    monkeypatch.setattr(Kernel, "strict", False)
    picture = np.ones((6, 6), np.bool_)
    turned = np.asfortranarray(picture)
    turned = np.concatenate([turned, turned])[::2]
    assert distance_sum(turned) == distance_sum(np.ascontiguousarray(turned))
    assert "measure.distance_sum: argument 0 is bool[:, :], not C-contiguous" in caplog.text


def test_what_only_kernels_call_takes_whatever_it_is_given():
    @inner_kernel
    def double(value):
        return value + value

    assert double.function(2) == 4
    assert isinstance(double, Kernel)
    assert not double.takes


def calls_in(path):
    """The kernels that plain Python calls in a file of the library, as (kernel file, name)."""
    tree, own = ast.parse(path.read_text()), path.parent.name == "kernels"
    named, modules = {}, {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(kernels.__name__):
            for one in node.names:
                file = node.module.removeprefix(kernels.__name__).removeprefix(".")
                place = (file, one.name) if file else one.name
                (named if file else modules)[one.asname or one.name] = place
    plain = [
        node for node in tree.body
        if not own or not isinstance(node, ast.FunctionDef)
        or not any(
            made in ast.dump(one) for one in node.decorator_list for made in ("kernel", "intrinsic")
        )
    ]  # fmt: skip
    for node in (one for part in plain for one in ast.walk(part)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            yield named.get(node.id, (path.stem if own else "", node.id))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield modules.get(node.value.id, ""), node.attr


def test_every_kernel_that_python_calls_says_what_it_takes():
    """The others would be compiled when they are called, for each user anew."""
    files = {name: importlib.import_module(f"{kernels.__name__}.{name}") for name in kernel_files()}
    silent = {
        (name, one.__name__)
        for name, module in files.items()
        for one in vars(module).values()
        if isinstance(one, Kernel) and one.file == name and not one.takes
    }
    # To parse all modules takes seconds: those that do not import kernels call none.
    near = [
        path
        for path in sorted((ROOT / "simplifier").rglob("*.py"))
        if path.parent.name == "kernels" or kernels.__name__ in path.read_text()
    ]
    called = [
        f"{path.relative_to(ROOT)}: {'.'.join(call)}"
        for path in near
        for call in calls_in(path)
        if call in silent
    ]
    assert not called


def test_ones_are_counted_in_plain_python_too():
    assert popcount(np.uint64(2**64 - 1)) == 64


def test_without_a_compiler_kernels_are_the_functions_that_they_were_written_as():
    code = (
        "import numpy as np, sys\n"
        "from simplifier.kernels.measure import score_images\n"
        "print(type(score_images).__name__, score_images(np.full((1, 64), 3, np.uint64)))\n"
        "assert 'numba' not in sys.modules and 'llvmlite' not in sys.modules"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(NUMBA_DISABLE_JIT="1"), text=True,
        capture_output=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["function", str(score_images(np.full((1, 64), 3, np.uint64)))]
