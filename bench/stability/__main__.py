"""All tables of stability on one page: ``python -m bench.stability``.

Measures nothing: the modules beside this one write the tables, and those of the fuzzer are kept by
hand.  Writes ``bench/results/stability.md`` from ``bench/results/stability_NAME.csv``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.record import write_page
from bench.stability.produced import RESULTS

TABLES = (
    "transforms", "shapes", "options", "input_far", "input_nonsense", "memory",
    "convergence_report", "convergence_measure", "convergence_making", "convergence_slicers",
    "convergence_forms", "fuzz_runs", "fuzz_found",
)  # fmt: skip
"""In the order of the page.  What convergence measured value by value stays in its CSV files."""


def write_stability_page(folder: Path) -> Path:
    """``folder/stability.md`` from the tables that are in ``folder``."""
    return write_page(folder, "stability", TABLES)


def main() -> None:
    """Write the page and print where it is."""
    parser = argparse.ArgumentParser(prog="python -m bench.stability", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.parse_args()
    print(write_stability_page(RESULTS))


if __name__ == "__main__":
    main()
