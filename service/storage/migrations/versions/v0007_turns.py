"""Turns of tenants, and priorities of their jobs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text, whole

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # By hand: Alembic leaves the check of an added column out.
    op.execute(
        "ALTER TABLE jobs ADD COLUMN priority VARCHAR(16) DEFAULT 'interactive' NOT NULL"
        " CONSTRAINT ck_jobs_priority CHECK (priority IN ('interactive', 'bulk'))"
    )
    op.create_index("ix_jobs_line", "jobs", ["state", "tenant", "priority", "number"])
    op.create_index("ix_api_keys_live", "api_keys", ["revoked", "tenant"])
    op.create_table(
        "turns",
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("turn", whole(), nullable=False),
        sa.Column("streak", whole(), nullable=False),
        sa.PrimaryKeyConstraint("tenant", name="pk_turns"),
    )
    op.create_index("ix_turns_turn", "turns", ["turn"])


def downgrade() -> None:
    op.drop_table("turns")
    op.drop_index("ix_api_keys_live", "api_keys")
    op.drop_index("ix_jobs_line", "jobs")
    op.drop_column("jobs", "priority")
