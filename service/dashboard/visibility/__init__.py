"""Visible sets of a job: cells in plan, what each may see in 3D, the largest sets in a table."""
