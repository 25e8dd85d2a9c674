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
    op.add_column("jobs", sa.Column("trace", Text()))
    op.add_column(
        "jobs", sa.Column("tallied", sa.Boolean(), nullable=False, server_default=sa.false())
    )
    op.execute("UPDATE jobs SET tallied = true WHERE ended IS NOT NULL")
    ended = sa.text("ended IS NOT NULL AND NOT tallied")
    op.create_index(
        "ix_jobs_untallied", "jobs", ["number"], sqlite_where=ended, postgresql_where=ended
    )
    # What may be lost in a crash need not be flushed with each change.
    unlogged = ["UNLOGGED"] if op.get_bind().dialect.name == "postgresql" else []
    op.create_table(
        "progress",
        sa.Column("job_id", sa.String(32), nullable=False),
        sa.Column("stage", Text(), nullable=False),
        sa.Column("fraction", sa.Double, nullable=False),
        sa.Column("measure", sa.Double),
        sa.Column("level", whole(), nullable=False),
        sa.Column("levels", whole(), nullable=False),
        sa.Column("seconds", sa.Double, nullable=False),
        sa.Column("picture", sa.LargeBinary),
        sa.Column("picture_number", whole(), nullable=False),
        sa.PrimaryKeyConstraint("job_id", name="pk_progress"),
        prefixes=unlogged,
    )
    op.create_table(
        "failed_sign_ins",
        sa.Column("bucket", Text(), nullable=False),
        sa.Column("level", sa.Double, nullable=False),
        sa.Column("at", sa.Double, nullable=False),
        sa.PrimaryKeyConstraint("bucket", name="pk_failed_sign_ins"),
        prefixes=unlogged,
    )
    op.create_index("ix_failed_sign_ins_at", "failed_sign_ins", ["at"])
    op.create_table(
        "tallies",
        sa.Column("labels", Text(), nullable=False),
        sa.Column("count", whole(), nullable=False),
        sa.Column("total", sa.Double, nullable=False),
        sa.PrimaryKeyConstraint("labels", name="pk_tallies"),
    )
    op.create_table(
        "deployment",
        sa.Column("number", whole(), nullable=False),
        sa.Column("release", Text(), nullable=False),
        sa.Column("runs_from", Text(), nullable=False),
        sa.Column("secret", Text(), nullable=False, server_default=""),
        sa.CheckConstraint("number = 1", name="number"),
        sa.PrimaryKeyConstraint("number", name="pk_deployment"),
    )


def downgrade() -> None:
    op.drop_table("deployment")
    for table in ("tallies", "failed_sign_ins", "progress"):
        op.drop_table(table)
    op.drop_index("ix_jobs_untallied", "jobs")
    op.drop_column("jobs", "trace")
    op.drop_column("jobs", "tallied")
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
