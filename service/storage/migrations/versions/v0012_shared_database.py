"""What several servers need of a database: counted lines, pauses, and the release that works.

The line of a tenant takes the place of its turns.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text, whole

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

_LINE = ["state", "tenant", "priority", "number"]


def upgrade() -> None:
    op.add_column("jobs", sa.Column("due", sa.Double, nullable=False, server_default=sa.text("0")))
    op.drop_index("ix_jobs_line", "jobs")
    op.create_index("ix_jobs_line", "jobs", [*_LINE, "due"])
    op.create_table(
        "lines",
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("turn", whole(), nullable=False),
        sa.Column("streak", whole(), nullable=False),
        sa.Column("waiting", whole(), nullable=False),
        sa.Column("running", whole(), nullable=False),
        sa.CheckConstraint("waiting >= 0 AND running >= 0", name="counts"),
        sa.PrimaryKeyConstraint("tenant", name="pk_lines"),
    )
    op.create_index("ix_lines_turn", "lines", ["turn"])
    some = sa.text("waiting > 0")
    op.create_index(
        "ix_lines_waiting", "lines", ["tenant"], sqlite_where=some, postgresql_where=some
    )
    op.execute(
        "INSERT INTO lines (tenant, turn, streak, waiting, running)"
        " SELECT tenant, max(turn), max(streak), sum(waiting), sum(running) FROM ("
        "  SELECT tenant, turn, streak, 0 AS waiting, 0 AS running FROM turns"
        "  UNION ALL"
        "  SELECT tenant, 0, 0, sum(CASE state WHEN 'queued' THEN 1 ELSE 0 END),"
        "   sum(CASE state WHEN 'running' THEN 1 ELSE 0 END)"
        "  FROM jobs WHERE state IN ('queued', 'running') GROUP BY tenant"
        " ) AS counted GROUP BY tenant"
    )
    op.drop_table("turns")
    op.add_column("deliveries", sa.Column("owner", Text()))
    op.create_table(
        "deployment",
        sa.Column("number", whole(), nullable=False),
        sa.Column("release", Text(), nullable=False),
        sa.Column("runs_from", Text(), nullable=False),
        sa.CheckConstraint("number = 1", name="number"),
        sa.PrimaryKeyConstraint("number", name="pk_deployment"),
    )


def downgrade() -> None:
    op.drop_table("deployment")
    op.drop_column("deliveries", "owner")
    op.create_table(
        "turns",
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("turn", whole(), nullable=False),
        sa.Column("streak", whole(), nullable=False),
        sa.PrimaryKeyConstraint("tenant", name="pk_turns"),
    )
    op.create_index("ix_turns_turn", "turns", ["turn"])
    op.execute("INSERT INTO turns (tenant, turn, streak) SELECT tenant, turn, streak FROM lines")
    op.drop_table("lines")
    op.drop_index("ix_jobs_line", "jobs")
    op.create_index("ix_jobs_line", "jobs", _LINE)
    op.drop_column("jobs", "due")
