"""The cells that name a job, in every table of jobs."""

from __future__ import annotations

from service.dashboard.jobs.job_lines import JobLine
from service.dashboard.jobs.words import KINDS
from service.dashboard.plain_table import PlainTable


def name_cells(table: PlainTable, line: JobLine) -> None:
    """Three cells: the job, its asset, its kind."""
    table.link(line.name, f"/jobs/{line.id}")
    if line.asset_id:
        table.link(line.asset or "", f"/assets/{line.asset_id}")
    else:
        table.text("-", "quiet")
    table.text(KINDS[line.kind])
