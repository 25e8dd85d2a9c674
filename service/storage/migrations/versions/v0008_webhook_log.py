"""The log of webhooks, secrets of webhooks that were rotated, and by which request a job came."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text, whole

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("jobs", sa.Column("request_id", sa.String(64)))
    op.add_column(
        "deliveries", sa.Column("redelivered", whole(), nullable=False, server_default="0")
    )
    op.create_table(
        "delivery_attempts",
        sa.Column("number", whole(), primary_key=True),
        sa.Column(
            "delivery_number",
            whole(),
            sa.ForeignKey("deliveries.number", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("at", sa.Double, nullable=False),
        sa.Column("milliseconds", sa.Double, nullable=False),
        sa.Column("status", whole()),
        sa.Column("reason", Text(), nullable=False),
        sa.Column("excerpt", Text()),
        sqlite_autoincrement=True,
    )
    op.create_index(
        "ix_delivery_attempts_delivery_number", "delivery_attempts", ["delivery_number"]
    )
    op.create_table(
        "webhook_secrets",
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("generation", whole(), nullable=False),
        sa.Column("overlap_ends", sa.Double, nullable=False),
        sa.PrimaryKeyConstraint("tenant", name="pk_webhook_secrets"),
    )


def downgrade() -> None:
    for table in ("webhook_secrets", "delivery_attempts"):
        op.drop_table(table)
    op.drop_column("deliveries", "redelivered")
    op.drop_column("jobs", "request_id")
