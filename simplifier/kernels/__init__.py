"""Compiled inner loops: the only folder that imports numba.

A kernel takes arrays and scalars of fixed types and fills arrays that the caller made.  It checks
nothing: its caller in the stage above has done so.  Kernels are compiled with ``nogil`` and cached
on disk; none uses numba's own threads, :mod:`simplifier.kernels.threads` spreads the work, so a
process may fork, and two jobs may run at once.
"""
