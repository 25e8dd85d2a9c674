"""Figures of ``docs/stability.md``: one module a table, each run by itself.

``python -m bench.stability`` then puts all tables on one page.
"""
