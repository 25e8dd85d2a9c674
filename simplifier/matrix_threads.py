"""Threads of the libraries by which numpy multiplies matrices.

The matrices here are small, and kernels have threads of their own.  A thread of such a library
waits by going round in circles, after its start and after each product: for up to a tenth of a
second it takes a processor that a kernel could have.
"""

from __future__ import annotations

ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
}
"""Variables of the environment by which a process has none: set before it loads numpy."""
