"""The log of webhooks, secrets of webhooks that were rotated, and by which request a job came."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("jobs", sa.Column("request_id", sa.String(64)))
    op.add_column(
        "deliveries", sa.Column("redelivered", sa.Integer, nullable=False, server_default="0")
    )
    op.create_table(
        "delivery_attempts",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column(
            "delivery_number",
            sa.Integer,
            sa.ForeignKey("deliveries.number", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("at", sa.Double, nullable=False),
        sa.Column("milliseconds", sa.Double, nullable=False),
        sa.Column("status", sa.Integer),
        sa.Column("reason", sa.String, nullable=False),
        sa.Column("excerpt", sa.String),
        sqlite_autoincrement=True,
    )
    op.create_index(
        "ix_delivery_attempts_delivery_number", "delivery_attempts", ["delivery_number"]
    )
    op.create_table(
        "webhook_secrets",
        sa.Column("tenant", sa.String, nullable=False),
        sa.Column("generation", sa.Integer, nullable=False),
        sa.Column("overlap_ends", sa.Double, nullable=False),
        sa.PrimaryKeyConstraint("tenant", name="pk_webhook_secrets"),
    )


def downgrade() -> None:
    for table in ("webhook_secrets", "delivery_attempts"):
        op.drop_table(table)
    op.drop_column("deliveries", "redelivered")
    op.drop_column("jobs", "request_id")
