"""What loading the kernels costs: not what they never use."""

from __future__ import annotations

import subprocess
import sys

from tests.acceptance.command import environment

FIRST = """
import sys
import numpy as np
from simplifier.kernels.coverage import coverage_masks
coverage_masks(np.zeros((3, 3)), np.zeros((1, 3), np.int32), np.zeros((1, 2, 4)), 8, 8)
assert "scipy.linalg" not in sys.modules
import numba
product = numba.njit(lambda a, b: np.dot(a, b))
print(product(np.full((2, 2), 2.0), np.eye(2)).sum(), "scipy.linalg" in sys.modules)
"""


def test_a_kernel_loads_no_linear_algebra_and_a_product_of_somebody_else_finds_it():
    done = subprocess.run(
        [sys.executable, "-c", FIRST],
        env=environment(), capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert done.stdout == "8.0 True\n"
