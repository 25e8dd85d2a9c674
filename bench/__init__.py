"""Benchmarks: ``python -m bench.speed`` and ``python -m bench.quality``.

Results go to ``bench/results`` as CSV, PNG and Markdown, each with the command, the machine and the
date that made it.
"""
