"""Figures of ``docs/stability.md``: one module a table, each run by itself."""
